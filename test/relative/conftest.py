"""Hypothesis without deadlines: the cost of a random orbit varies."""

from hypothesis import settings

settings.register_profile("unhurried", deadline=None, max_examples=25)
settings.load_profile("unhurried")
