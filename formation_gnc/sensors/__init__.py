"""Sensors: measurement functions with their noise, used by plant, filter and plots."""
