"""Scenarios and the in-process runner."""
