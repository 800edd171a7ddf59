"""Differential J2: against two integrated inertial orbits, its Jacobian, and bounded motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel

orbits = st.builds(
    lambda perigee, *rest: Elements(perigee / (1.0 - rest[0]), *rest),
    st.floats(6.9e6, 4.2e7),
    st.floats(0.0, 0.6),
    st.floats(0.0, math.pi),
    *[st.floats(0.0, 6.28)] * 3,
)
states = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(
    lambda numbers: np.array(numbers) * np.repeat([2e4, 20.0], 3)
)


def potential(place):
    """Point mass and J2 as a potential, Joshi (3.45) with P2 = (3 s^2 - 1) / 2."""
    r = np.linalg.norm(place)
    return MU / r * (1.0 - J2 * (EARTH_RADIUS / r) ** 2 * (1.5 * (place[2] / r) ** 2 - 0.5))


def attraction(place):
    x, y, z = place
    r = np.linalg.norm(place)
    k = 1.5 * J2 * (EARTH_RADIUS / r) ** 2
    return -MU / r**3 * np.array([x, y, z]) * (1.0 + k * (np.array([1.0, 1.0, 3.0]) - 5.0 * (z / r) ** 2))


def inertial(state, duration):
    solution = solve_ivp(
        lambda _, s: np.concatenate((s[3:], attraction(s[:3]))),
        (0.0, duration),
        state,
        method="DOP853",
        rtol=1e-13,
        atol=1e-9,
    )
    return solution.y[:, -1]


def test_reference_acceleration_is_the_gradient_of_the_potential():
    place = np.array([5e6, -3e6, 4e6])
    gradient = [(potential(place + d) - potential(place - d)) / 200.0 for d in 100.0 * np.eye(3)]
    np.testing.assert_allclose(attraction(place), gradient, rtol=1e-8)


@settings(max_examples=10)
@given(orbits, states)
@pytest.mark.thorough
def test_motion_is_the_difference_of_two_inertial_orbits(elements, state):
    chief = state_from_elements(elements)
    model = OblateModel(OblateChief(elements))
    duration = 0.3 * elements.period
    expected = relative_from_inertial(
        inertial(chief, duration), inertial(inertial_from_relative(chief, state), duration)
    )
    ours = model.propagate(0.0, state, duration)
    # Differences of inertial states carry the integrator's 1e-13 of the orbit's size, times its growth.
    size = elements.semi_major_axis
    np.testing.assert_allclose(ours[:3], expected[:3], atol=3e-11 * size)
    np.testing.assert_allclose(ours[3:], expected[3:], atol=3e-10 * size * elements.mean_motion)


@given(orbits, states, st.floats(0.0, 1e4))
def test_jacobian_is_the_derivative(elements, state, time):
    model = OblateModel(OblateChief(elements))
    differences = [
        (model.derivative(time, state + d) - model.derivative(time, state - d)) / (2.0 * np.linalg.norm(d))
        for d in np.diag(np.repeat([100.0, 0.1], 3))
    ]
    # Central differences: their error is the third derivative, about MU / r^5 times the step squared.
    radius = model.chief.at(time).radius
    np.testing.assert_allclose(
        model.dynamics(time, state),
        np.array(differences).T,
        rtol=1e-9,
        atol=100 * MU / radius**5 * 100.0**2 + 1e-13,
    )


@settings(max_examples=10)
@given(orbits, st.floats(0.0, 3e4), st.floats(-2e4, 2e4))
def test_oblate_chief_does_not_depend_on_earlier_calls(elements, first, second):
    once = OblateChief(elements).inertial(first).copy()
    other = OblateChief(Elements(elements.semi_major_axis * (1 + 1e-12), *list(vars(elements).values())[1:]))
    other.inertial(second)
    other.inertial(first)
    OblateChief(elements).inertial(second)
    np.testing.assert_array_equal(OblateChief(elements).inertial(first), once)


def test_oblate_chief_agrees_with_scipy():
    elements = Elements(8e6, 0.1, 1.0, 0.3, 0.4, 0.5)
    chief = OblateChief(elements)
    for time in (-3000.0, 20000.0):
        expected = inertial(state_from_elements(elements), time)
        np.testing.assert_allclose(chief.inertial(time)[:3], expected[:3], atol=1e-3)  # 1e-13 for three orbits


@pytest.mark.parametrize("inclination", [0.0, 0.3, 1.7, math.pi])
def test_latitude_repeats_after_a_nodal_period(inclination):
    elements = Elements(7.2e6, 0.001, inclination, 0.2, 0.4, 0.5)
    period = OblateChief(elements).period
    start, after = state_from_elements(elements), inertial(state_from_elements(elements), period)
    if inclination in (0.0, math.pi):
        turn = math.atan2(start[0] * after[1] - start[1] * after[0], start[:2] @ after[:2])
        assert turn == pytest.approx(0.0, abs=1e-9)
    else:
        normal = np.cross(after[:3], after[3:])
        node = np.cross([0.0, 0.0, 1.0], normal)
        latitude = math.atan2(after[:3] @ np.cross(normal, node) / np.linalg.norm(normal), after[:3] @ node)
        assert math.remainder(latitude - 0.9, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.thorough
def test_bounded_motion_does_not_drift_where_the_two_body_one_does():
    elements = Elements(7.2e6, 0.01, 0.9, 0.3, 0.4, 0.5)
    model = OblateModel(OblateChief(elements))
    state = np.array([100.0, 200.0, -50.0, 0.1, -0.2, 0.05])

    def drift(start):
        """Change of the mean along-track position over one revolution, m: the second against the first."""
        period, states = model.period, [start]
        for index in range(32):
            states.append(model.propagate(index / 16 * period, states[-1], period / 16))
        along = [s[1] for s in states]
        return np.mean(along[16:32]) - np.mean(along[:16])

    # First-order theory: terms of order J2^2 and e J2 of the 200 m, which are millimetres.
    assert abs(drift(model.bounded(0.0, state))) < 0.01
    two_bodies = NonlinearModel(KeplerChief.of(elements)).bounded(0.0, state)
    assert abs(drift(two_bodies)) > 0.5
