"""Mean elements under J2: constancy, secular rates, averages, round trips through every singular case."""

from math import pi, radians, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.mean import (
    mean_elements,
    mean_state,
    osculating_elements,
    osculating_state,
    secular_rates,
)
from formation_gnc.orbit.propagation import Propagator

ORBITS = [
    pytest.param(Elements(7e6, 0.001, radians(85.0), 0.3, 0.2, 0.1), id="near-polar"),
    pytest.param(Elements(7.2e6, 0.05, radians(30.0), 0.3, 0.2, 1.1), id="inclined"),
    pytest.param(Elements(8e6, 0.15, radians(63.4349), 0.3, 0.2, 2.1), id="critical"),
    pytest.param(Elements(2.4e7, 0.7, radians(50.0), 0.3, 0.2, 0.1), id="eccentric"),
    pytest.param(Elements(7.1e6, 0.02, radians(120.0), 0.3, 0.2, 0.1), id="retrograde"),
]


def propagated(elements, orbits, samples):
    """Osculating states, evenly spaced in time."""
    step = elements.period / samples
    propagator = Propagator(step, substeps=max(1, round(800 / samples)))
    states = [state_from_elements(elements)]
    for _ in range(orbits * samples):
        states.append(propagator.propagate(0.0, states[-1][None], np.zeros((1, 3)))[0])
    return np.arange(len(states)) * step, states


def rate(times, angles):
    return np.polyfit(times, np.unwrap(angles), 1)[0]


@pytest.mark.parametrize("orbit", ORBITS)
def test_mean_elements_are_constant_or_drift_at_the_secular_rates(orbit):
    times, states = propagated(orbit, orbits=15, samples=20)
    mean = [mean_elements(elements_from_state(state)) for state in states]
    osculating = [elements_from_state(state) for state in states]
    # The rest is of second order, J2 (R/p)^2 of the short-period variation.
    for name in ("semi_major_axis", "eccentricity", "inclination"):
        left = np.ptp([getattr(elements, name) for elements in mean])
        assert left < 0.004 * np.ptp([getattr(elements, name) for elements in osculating])
    node, perigee, anomaly = secular_rates(mean[0])
    # Rates are of the first order in J2, so good to about J2 relative to themselves: 0.5 % here.
    assert rate(times, [e.right_ascension for e in mean]) == pytest.approx(node, rel=5e-3)
    perigee_found = rate(times, [e.argument_of_perigee for e in mean])
    assert perigee_found == pytest.approx(perigee, rel=5e-3, abs=3e-6 * J2)
    latitude = rate(times, [e.argument_of_perigee + e.mean_anomaly for e in mean])
    assert latitude == pytest.approx(perigee + anomaly, rel=1e-5)


@pytest.mark.parametrize("orbit", ORBITS)
def test_mean_semi_major_axis_is_the_average_over_an_orbit(orbit):
    """The average over time is that over the mean anomaly up to second-order terms."""
    _, states = propagated(orbit, orbits=1, samples=2000)
    average = np.mean([elements_from_state(state).semi_major_axis for state in states[:-1]])
    variation = np.ptp([elements_from_state(state).semi_major_axis for state in states])
    mean = mean_elements(orbit).semi_major_axis
    assert average == pytest.approx(mean, abs=0.005 * variation)


@pytest.mark.parametrize("orbit", ORBITS)
def test_mean_orbit_has_the_energy_of_the_osculating_one(orbit):
    state = state_from_elements(orbit)
    r = np.linalg.norm(state[:3])
    oblate = MU * J2 * EARTH_RADIUS**2 / (2 * r**3) * (3 * (state[2] / r) ** 2 - 1)
    true = -MU / (2 * orbit.semi_major_axis) + oblate
    mean = mean_elements(orbit)
    p = mean.semi_major_axis * (1 - mean.eccentricity**2)
    shape = (1 - mean.eccentricity**2) ** 1.5
    averaged = MU * J2 * EARTH_RADIUS**2 / (2 * p**3) * shape * (1.5 * np.sin(mean.inclination) ** 2 - 1)
    energy = -MU / (2 * mean.semi_major_axis) + averaged
    # Second order: J2 (R/p)^2 of the first-order part.
    assert energy == pytest.approx(true, abs=20 * J2 * abs(averaged))
    assert abs(averaged) > 100 * abs(energy - true)


@given(
    st.sampled_from([0.0, 1e-12, 1e-4, 0.1, 0.7]),
    st.sampled_from([0.0, 1e-9, 0.5, 1.1071487, pi / 2, pi]),
    st.floats(0.0, tau),
    st.floats(0.0, tau),
)
def test_transformation_is_invertible_at_singular_orbits(eccentricity, inclination, perigee, anomaly):
    state = state_from_elements(Elements(7e6 / (1 - eccentricity), eccentricity, inclination, 0.3, perigee, anomaly))
    mean = mean_state(state)
    assert np.isfinite(mean).all()
    assert 10.0 < np.linalg.norm((mean - state)[:3]) < 50e3
    again = osculating_state(mean)
    assert np.linalg.norm((again - state)[:3]) < 1e-7 / (1 - eccentricity)
    assert np.linalg.norm((again - state)[3:]) < 1e-10


def test_transformation_is_smooth_at_circular_and_equatorial_orbits():
    """Neighbours a metre apart stay about a metre apart: nothing jumps where elements are singular."""
    circular = state_from_elements(Elements(7e6, 0.0, 0.0, 0.0, 0.0, 1.0))
    shift = mean_state(circular) - circular
    for direction in np.eye(6) * ([1.0] * 3 + [1e-3] * 3):
        near = circular + direction
        assert np.linalg.norm((mean_state(near) - near - shift)[:3]) < 0.05


def test_elements_and_states_transform_alike():
    orbit = Elements(7e6, 0.01, 1.0, 0.3, 0.2, 0.1)
    assert state_from_elements(mean_elements(orbit)) == pytest.approx(mean_state(state_from_elements(orbit)), rel=1e-12)
    again = osculating_elements(mean_elements(orbit))
    assert again.semi_major_axis == pytest.approx(7e6, rel=1e-13)
    assert again.eccentricity == pytest.approx(0.01, abs=1e-13)


def test_secular_rates_of_a_textbook_orbit():
    """Sun-synchronous, 800 km, 98.603 deg: nodal precession of 360 deg a tropical year."""
    node, perigee, _ = secular_rates(Elements(EARTH_RADIUS + 800e3, 0.0, radians(98.603), 0.0, 0.0, 0.0))
    assert np.degrees(node) * 86400 * 365.2422 == pytest.approx(360.0, rel=2e-3)
    critical = Elements(8e6, 0.1, np.arccos(np.sqrt(0.2)), 0.0, 0.0, 0.0)
    assert secular_rates(critical)[1] == pytest.approx(0.0, abs=1e-20)
    assert perigee < 0.0


def test_satellites_of_equal_mean_semi_major_axis_stay_together():
    """Satellites of equal osculating semi-major axis drift apart."""
    chief = Elements(7e6, 0.001, 1.2, 0.0, 0.0, 0.0)
    mean = mean_elements(chief)
    ahead = Elements(
        mean.semi_major_axis,
        mean.eccentricity,
        mean.inclination,
        mean.right_ascension,
        mean.argument_of_perigee,
        mean.true_anomaly + 0.01,
    )
    matched = osculating_elements(ahead)
    naive = Elements(7e6, 0.001, 1.2, 0.0, 0.0, 0.01)

    def drift(deputy):
        propagator = Propagator(60.0, substeps=6)
        states = np.array([state_from_elements(chief), state_from_elements(deputy)])
        separations = []
        for k in range(1455):  # 15 orbits
            states = propagator.propagate(60.0 * k, states, np.zeros((2, 3)))
            separations.append(np.linalg.norm(states[1, :3] - states[0, :3]))
        return abs(np.mean(separations[-97:]) - np.mean(separations[:97]))

    assert drift(matched) < 1.0
    assert drift(naive) > 100 * drift(matched)
