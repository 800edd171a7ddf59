"""Injected faults: one file for each part of a satellite that they are in, one registry, one injection."""
