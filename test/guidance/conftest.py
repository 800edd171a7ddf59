"""Fixtures of the guidance tests; properties have no deadline, as machines differ."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.parameters import load
from formation_gnc.records import NavigationState
from formation_gnc.types import NANOSECONDS

BuildGuidance = Callable[..., Guidance]
EstimateAt = Callable[[float], NavigationState]


@pytest.fixture(scope="session")
def build_guidance() -> BuildGuidance:
    """Guidance of a deputy on its own, given parameters with `__` for the dot in their names."""

    def build(**values: Any) -> Guidance:
        given = {name.replace("__", "."): value for name, value in values.items()}
        return Guidance("/deputy1/guidance", load(GuidanceParameters, {"chief.semi_major_axis": 7.0e6} | given))

    return build


@pytest.fixture(scope="session")
def estimate_at() -> EstimateAt:
    """Estimate at a time (s) of a satellite of 100 kg, 100 m behind a chief without an orbit."""

    def build(second: float) -> NavigationState:
        behind = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
        return NavigationState(round(second * NANOSECONDS), behind, np.zeros(6), 100.0)

    return build
