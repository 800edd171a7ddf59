"""Nonlinear equations of relative motion against two inertial orbits, and their Jacobian."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.frames import hill_rate, inertial_from_relative, relative_from_inertial
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.nonlinear import NonlinearModel

orbits = st.builds(
    lambda perigee, *rest: Elements(perigee / (1.0 - rest[0]), *rest),
    st.floats(7.2e6, 4.2e7),
    st.floats(0.0, 0.6),
    st.floats(0.0, math.pi),
    *[st.floats(0.0, 6.28)] * 3,
)
states = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(
    lambda numbers: np.array(numbers) * np.repeat([2e4, 20.0], 3)
)


def kepler(state, duration):
    """Inertial state after a duration, by SciPy."""
    solution = solve_ivp(
        lambda _, s: np.concatenate((s[3:], -MU * s[:3] / np.linalg.norm(s[:3]) ** 3)),
        (0.0, duration),
        state,
        method="DOP853",
        rtol=1e-13,
        atol=1e-9,
    )
    return solution.y[:, -1]


@settings(max_examples=15)
@given(orbits, states)
@pytest.mark.thorough
def test_motion_is_the_difference_of_two_inertial_orbits(elements, state):
    chief = state_from_elements(elements)
    model = NonlinearModel(KeplerChief.of(elements))
    duration = 0.3 * model.period
    deputy = inertial_from_relative(chief, state)
    expected = relative_from_inertial(kepler(chief, duration), kepler(deputy, duration))
    ours = model.propagate(0.0, state, duration)
    # Differences of inertial states carry the integrator's 1e-13 of the orbit's size, times its growth.
    size = elements.semi_major_axis
    np.testing.assert_allclose(ours[:3], expected[:3], atol=3e-11 * size)
    np.testing.assert_allclose(ours[3:], expected[3:], atol=3e-11 * size * hill_rate(chief) / (1.0 - 0.6) ** 2)


@given(orbits, states, st.floats(0.0, 1e5))
def test_jacobian_is_the_derivative(elements, state, time):
    model = NonlinearModel(KeplerChief.of(elements))
    steps = np.repeat([100.0, 0.1], 3)
    differences = [
        (model.derivative(time, state + d) - model.derivative(time, state - d)) / (2.0 * np.linalg.norm(d))
        for d in np.diag(steps)
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
@given(orbits, states)
def test_bounded_state_has_the_chiefs_energy(elements, state):
    model = NonlinearModel(KeplerChief.of(elements))
    start = model.bounded(0.0, state)
    np.testing.assert_array_equal(start[[0, 1, 2, 3, 5]], state[[0, 1, 2, 3, 5]])
    deputy = inertial_from_relative(state_from_elements(elements), start)
    assert elements_from_state(deputy).semi_major_axis == pytest.approx(elements.semi_major_axis, rel=1e-11)


@pytest.mark.thorough
def test_energy_is_conserved():
    elements = Elements(9e6, 0.2, 0.7, 0.0, 0.3, 1.0)
    chief, model = state_from_elements(elements), NonlinearModel(KeplerChief.of(elements))
    state = np.array([1e4, -3e4, 2e4, 5.0, -10.0, 3.0])
    later = model.propagate(0.0, state, 20000.0)
    before = elements_from_state(inertial_from_relative(chief, state)).semi_major_axis
    after = elements_from_state(inertial_from_relative(kepler(chief, 20000.0), later)).semi_major_axis
    assert after == pytest.approx(before, rel=1e-11)


def test_arrays_of_states_give_single_results():
    model = NonlinearModel(KeplerChief(8e6, 0.1))
    several = np.array([[1e3, 0, 0, 0, 0, 0], [0, 2e3, 10, 0.1, 0, 1]])
    thrust = np.array([1e-4, 0.0, -1e-4])
    together = model.propagate(50.0, several, 500.0, thrust)
    for state, moved in zip(several, together, strict=True):
        np.testing.assert_allclose(model.propagate(50.0, state, 500.0, thrust), moved, rtol=1e-13)


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"semi_major_axis": -1.0}, "semi_major_axis"),
        ({"semi_major_axis": math.nan}, "semi_major_axis"),
        ({"semi_major_axis": 7e6, "eccentricity": 1.0}, "eccentricity"),
        ({"semi_major_axis": 7e6, "mu": 0.0}, "mu"),
        ({"semi_major_axis": 7e6, "true_anomaly": math.inf}, "true_anomaly"),
    ],
)
def test_invalid_chief_is_rejected_by_name(values, name):
    with pytest.raises(OrbitError, match=name):
        KeplerChief(**values)
