"""Orbits: frames, elements, force models, propagation."""
