"""Relative-motion models, one file per model."""
