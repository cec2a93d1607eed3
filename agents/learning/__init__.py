"""Algorithms, training, checkpoints and evaluation."""
