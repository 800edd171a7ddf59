"""Supervision of one satellite: modes, health monitors, and the answers to faults."""
