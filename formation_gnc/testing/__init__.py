"""Tests that a plug-in inherits, for pytest and Hypothesis: `formation_gnc.testing.laws`."""

import pytest

pytest.register_assert_rewrite("formation_gnc.testing.laws")
