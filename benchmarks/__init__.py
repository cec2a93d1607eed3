"""Measurements: ratios of medians inside one run, so that a slow machine cancels."""
