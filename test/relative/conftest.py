"""Random orbits take as long as they take: no deadline on a shared machine."""

from hypothesis import settings

settings.register_profile("unhurried", deadline=None, max_examples=25)
settings.load_profile("unhurried")
