"""Keplerian elements: round trips through every singular case, published examples, rejections."""

from math import pi, radians, tau

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import (
    Elements,
    eccentric_anomaly,
    elements_from_state,
    mean_from_true_anomaly,
    state_from_elements,
    true_from_mean_anomaly,
)

ANGLE = st.floats(0.0, tau, exclude_max=True)
INCLINATION = st.one_of(st.floats(0.0, pi), st.sampled_from([0.0, pi / 2, pi, 1e-12, 1e-14, pi - 1e-12]))
ECCENTRICITY = st.one_of(st.floats(0.0, 0.9), st.sampled_from([0.0, 1e-16, 1e-12, 1e-8]))


@st.composite
def orbits(draw):
    eccentricity = draw(ECCENTRICITY)
    perigee = draw(st.floats(6.6e6, 5e7))
    return Elements(
        perigee / (1 - eccentricity), eccentricity, draw(INCLINATION), draw(ANGLE), draw(ANGLE), draw(ANGLE)
    )


@given(orbits())
@example(Elements(7e6, 0.0, 0.0, 1.0, 2.0, 3.0))
@example(Elements(7e6, 0.0, pi, 1.0, 2.0, 3.0))
@example(Elements(8e6, 0.1, pi, 1.0, 2.0, 3.0))
@example(Elements(7e6, 0.0, 1.0, 1.0, 2.0, 3.0))
@pytest.mark.covers(
    "Kremmydas 1.1.1",
    "orbit/elements.py",
    differs="the root of a negative number in the rate of f, and b/a for the eccentricity",
)
def test_state_to_elements_and_back_is_the_same_state(elements):
    state = state_from_elements(elements)
    again = state_from_elements(elements_from_state(state))
    # Rounding, plus at most SINGULAR of a direction taken by convention, amplified by 1/(1-e) at high e.
    tolerance = 1e-12 / (1.0 - elements.eccentricity)
    assert np.linalg.norm(again[:3] - state[:3]) < tolerance * np.linalg.norm(state[:3])
    assert np.linalg.norm(again[3:] - state[3:]) < tolerance * np.linalg.norm(state[3:])


@given(st.floats(0.001, 0.9), st.floats(0.01, pi - 0.01), ANGLE, ANGLE, ANGLE)
def test_elements_to_state_and_back_are_the_same_elements(eccentricity, inclination, node, perigee, anomaly):
    elements = Elements(7e6 / (1 - eccentricity), eccentricity, inclination, node, perigee, anomaly)
    again = elements_from_state(state_from_elements(elements))
    assert again.semi_major_axis == pytest.approx(elements.semi_major_axis, rel=1e-13 / (1 - eccentricity))
    assert again.eccentricity == pytest.approx(eccentricity, abs=1e-14)
    assert again.inclination == pytest.approx(inclination, abs=1e-13)
    # The error of an angle is inverse to its lever arm: sin i for the node, e for perigee.
    for name, lever in (("right_ascension", 0.01), ("argument_of_perigee", 1e-3), ("true_anomaly", 1e-3)):
        difference = getattr(again, name) - getattr(elements, name)
        assert abs(np.sin(difference / 2)) < 2e-15 / lever


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        # Circular: the anomaly is counted from the node; if equatorial too, from x in the sense of motion.
        ([0, 7e6, 0, -1, 0, 0], (0.0, 0.0, 0.0, 0.0, pi / 2)),
        ([0, 7e6, 0, 1, 0, 0], (0.0, pi, 0.0, 0.0, 3 * pi / 2)),
        ([0, 0, 7e6, -1, 0, 0], (0.0, pi / 2, 0.0, 0.0, pi / 2)),
        ([0, 0, 7e6, 1, 0, 0], (0.0, pi / 2, pi, 0.0, pi / 2)),
        # Eccentric and equatorial: perigee on the y axis.
        ([0, 7e6, 0, -1.1, 0, 0], (0.21, 0.0, 0.0, pi / 2, 0.0)),
        ([0, 7e6, 0, 1.1, 0, 0], (0.21, pi, 0.0, 3 * pi / 2, 0.0)),
    ],
)
def test_singular_orbits_follow_the_convention(state, expected):
    state = np.array(state, dtype=float)
    state[3:] *= np.sqrt(MU / 7e6)
    found = elements_from_state(state)
    assert (
        found.eccentricity,
        found.inclination,
        found.right_ascension,
        found.argument_of_perigee,
        found.true_anomaly,
    ) == pytest.approx(expected, abs=1e-14)


@pytest.mark.covers("Joshi Fig. 3.5", "orbit/elements.py", differs="a drawing: its elements are ours")
def test_vallado_example_of_state_to_elements():
    """Vallado, Fundamentals of Astrodynamics, example 2-5 (his gravity, his digits).

    His perigee is below the surface: orbit ten times larger, gravitational parameter a thousand times.
    """
    state = np.array([6524.834, 6862.875, 6448.296, 4.901327, 5.533756, -1.976341]) * 1e4
    found = elements_from_state(state, mu=3.986004418e17)
    assert found.semi_major_axis == pytest.approx(361273.43e3, rel=2e-6)
    assert found.eccentricity == pytest.approx(0.832853, abs=1e-6)
    assert found.inclination == pytest.approx(radians(87.870), abs=radians(5e-3))
    assert found.right_ascension == pytest.approx(radians(227.898), abs=radians(5e-3))
    assert found.argument_of_perigee == pytest.approx(radians(53.38), abs=radians(1e-2))
    assert found.true_anomaly == pytest.approx(radians(92.335), abs=radians(5e-3))


@given(st.floats(-50.0, 50.0), st.one_of(st.floats(0.0, 0.999), st.sampled_from([0.0, 1 - 1e-12])))
@example(0.0, 1 - 1e-12)
@example(1e-9, 1 - 1e-12)
@example(pi, 0.999)
def test_kepler_equation_is_solved_to_rounding_error(mean_anomaly, eccentricity):
    anomaly = eccentric_anomaly(mean_anomaly, eccentricity)
    residual = anomaly - eccentricity * np.sin(anomaly) - mean_anomaly
    assert abs(residual) < 4e-16 * max(1.0, abs(mean_anomaly)) * 4


@given(ANGLE, st.floats(0.0, 0.95))
def test_mean_and_true_anomaly_are_inverse(anomaly, eccentricity):
    again = true_from_mean_anomaly(mean_from_true_anomaly(anomaly, eccentricity), eccentricity)
    assert abs(np.sin((again - anomaly) / 2)) < 1e-13


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"eccentricity": 1.0}, "eccentricity is 1.0"),
        ({"eccentricity": -0.1}, "eccentricity is -0.1"),
        ({"semi_major_axis": -7e6}, "semi_major_axis is -7000000.0"),
        ({"eccentricity": 0.2}, "perigee radius is 5600000.0 m"),
        ({"inclination": 3.2}, "inclination is 3.2"),
        ({"true_anomaly": float("nan")}, "true_anomaly is nan"),
        ({"semi_major_axis": float("inf")}, "semi_major_axis is inf"),
    ],
)
def test_elements_that_cannot_be_flown_are_rejected(change, message):
    values = {
        "semi_major_axis": 7e6,
        "eccentricity": 0.0,
        "inclination": 1.0,
        "right_ascension": 0.0,
        "argument_of_perigee": 0.0,
        "true_anomaly": 0.0,
    }
    with pytest.raises(OrbitError, match=message):
        Elements(**values | change)


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ([0, 0, 0, 1, 0, 0], "radius is 0"),
        ([7e6, 0, 0, 100, 0, 0], "angular momentum is 0"),
        ([7e6, 0, 0, 0, 11e3, 0], "orbital energy"),
        ([7e6, 0, 0, 0, 6e3, 0], "perigee radius"),
        ([7e6, 0, np.nan, 0, 6e3, 0], "six finite"),
        ([7e6, 0, 0], "six finite"),
    ],
)
def test_states_without_a_closed_orbit_are_rejected(state, message):
    with pytest.raises(OrbitError, match=message):
        elements_from_state(np.array(state, dtype=float))
