"""Formations, target propagation, slot assignment."""
