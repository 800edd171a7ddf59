"""Tests that every law of formation_gnc passes, on this one."""

from formation_gnc.testing.laws import *  # noqa: F403

algorithm = laws_under_test("pd")  # noqa: F405
