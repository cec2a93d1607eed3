"""Adapters to other libraries; importing one needs its library, nothing else does."""
