"""Relative-motion models, one file a model, one registry."""
