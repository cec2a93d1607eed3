"""Arithmetic for one robot or many: the only room that knows which of the two is computed."""
