"""Hostile files, as data: what is done to a whole bag, and texts in place of parameter files."""
