"""Eclipse forecast against geometry and against the propagated illumination."""

import math

import numpy as np
import pytest

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.eclipse import eclipses
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.propagation import Propagator

EQUINOX = (9210 - 0.5) * 86400.0  # s since J2000.0: 20 March 2025, the Sun on the x axis
RADIUS = 7078136.3


def circular(inclination: float, anomaly: float, node: float = 0.0, radius: float = RADIUS) -> np.ndarray:
    return state_from_elements(Elements(radius, 0.0, inclination, node, 0.0, anomaly))


@pytest.fixture
def revolution() -> float:
    return math.tau / math.sqrt(MU / RADIUS**3)


def test_eclipse_in_the_suns_plane_lasts_as_a_cylindrical_shadow_says(revolution: float) -> None:
    nights = eclipses(circular(0.4, 0.0), 3.0 * revolution, revolution / 180.0, EQUINOX)
    assert len(nights) == 3
    expected = revolution * math.asin(EARTH_RADIUS / RADIUS) / math.pi
    # The node is on the Sun's line; the penumbra adds the Sun's half degree of the orbit.
    assert np.diff(nights)[:, 0] == pytest.approx(expected, abs=revolution * math.radians(0.6) / math.tau)
    middle = nights.mean(axis=1)
    assert middle[0] == pytest.approx(0.5 * revolution, rel=0.01)  # opposite the Sun
    assert np.diff(middle) == pytest.approx(revolution, rel=3e-3)  # J2: the nodal period is shorter


def test_orbit_facing_the_sun_has_no_eclipse(revolution: float) -> None:
    facing = circular(math.pi / 2.0, 0.0, math.pi / 2.0)
    assert not len(eclipses(facing, revolution, revolution / 180.0, EQUINOX))


def test_begin_and_end_are_those_of_the_propagated_illumination(revolution: float) -> None:
    state, tick = circular(1.7104, 1.0), 1.0
    nights = eclipses(state, 1.2 * revolution, revolution / 180.0, EQUINOX)
    propagator, now, dark = Propagator(tick, epoch=EQUINOX), state, []
    for k in range(int(1.2 * revolution)):
        dark.append(propagator.illumination(k * tick, now) < 1.0)
        now = propagator.propagate(k * tick, now[None], np.zeros((1, 3)))[0]
    changes = 1.0 + np.flatnonzero(np.diff(dark))
    bounds = nights.ravel()[(nights.ravel() > 0.0) & (nights.ravel() < len(dark) - 1)]
    assert len(changes) == len(bounds) >= 2
    assert np.all((bounds <= changes) & (bounds > changes - tick - 0.01))  # 1 ms, and 3 cm at 7.5 km/s


def test_eclipses_are_clipped_to_the_forecast_window(
    revolution: float,
) -> None:
    inside = circular(0.4, math.pi)
    assert eclipses(inside, 600.0, 30.0, EQUINOX) == pytest.approx(np.array([[0.0, 600.0]]))


def test_orbit_that_meets_the_earth_raises_impact_error() -> None:
    with pytest.raises(ImpactError):
        eclipses(np.zeros(6), 600.0, 30.0)
