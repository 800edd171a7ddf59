"""Eclipse forecast of guidance, renewed once a revolution."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from formation_gnc.guidance.guidance import Guidance
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.records import NavigationState
from formation_gnc.types import NANOSECONDS

from .conftest import BuildGuidance, EstimateAt

Array = NDArray[np.float64]

EQUINOX = (9210 - 0.5) * 86400.0
"""20 March 2025, with the Sun on the x axis, s since J2000.0."""

CHIEF = state_from_elements(Elements(7.0e6, 0.0, 0.4, 0.0, 0.0, 0.0))


def eclipse_of(guidance: Guidance, seconds: float, chief: Array) -> Array:
    time = round(seconds * NANOSECONDS)
    return guidance.on_tick(NavigationState(time, np.ones(6), chief, 1.0))[0].eclipses


def test_target_has_the_coming_eclipses_until_they_are_over(build_guidance: BuildGuidance) -> None:
    guidance = build_guidance(epoch=EQUINOX)
    revolution = math.tau / guidance.parameters.mean_motion

    def eclipse_at(share: float) -> Array:
        seconds = share * revolution
        state = propagate_with_transition(CHIEF, np.zeros(3), seconds, 200)[0] if seconds else CHIEF
        return eclipse_of(guidance, seconds, state)

    first = eclipse_at(0.0)
    assert len(first) == 2  # two revolutions ahead
    assert eclipse_at(0.5).tolist() == first.tolist()  # under way
    assert eclipse_at(0.9).tolist() == first[1:].tolist()
    again = eclipse_at(1.01)  # renewed, from the chief's state by then
    assert len(again) == 2
    assert again[0] == pytest.approx(first[1], abs=0.1 * NANOSECONDS)


def test_chief_without_an_orbit_has_no_eclipse(build_guidance: BuildGuidance, estimate_at: EstimateAt) -> None:
    assert not len(build_guidance().on_tick(estimate_at(0.0))[0].eclipses)


@pytest.mark.parametrize("bad", [np.full(6, np.nan), np.zeros(6)])
def test_forecast_is_kept_for_an_invalid_chief_and_renewed_soon(build_guidance: BuildGuidance, bad: Array) -> None:
    fresh, guidance = build_guidance(epoch=EQUINOX), build_guidance(epoch=EQUINOX)
    assert not len(eclipse_of(fresh, 0.0, bad))
    step = math.tau / fresh.parameters.mean_motion / 180
    assert len(eclipse_of(fresh, step + 1e-3, CHIEF)) == 2
    first = eclipse_of(guidance, 0.0, CHIEF)
    assert eclipse_of(guidance, 181 * step, bad).tolist() == first[1:].tolist(), "two revolutions ahead"
