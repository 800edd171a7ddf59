"""The relative navigation filter."""
