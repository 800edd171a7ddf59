"""Gim and Alfriend's transition matrix and its factors against the variational equations."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_transform, hill_transform_inverse, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.element_differences import sigma
from formation_gnc.relative.gim_alfriend import GimAlfriendModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

orbits = st.builds(
    lambda perigee, *rest: Elements(perigee / (1.0 - rest[0]), *rest),
    st.floats(6.9e6, 4.2e7),
    st.floats(0.0, 0.5),
    st.floats(0.1, math.pi - 0.1),
    *[st.floats(0.0, 6.28)] * 3,
)


def scaled(elements, matrix):
    """Matrix in units where time is 1 / n."""
    unit = np.repeat([1.0, elements.mean_motion], 3)
    return matrix * unit / unit[:, None]


def inertial_of(values):
    """Inertial state of [a, theta, i, q1, q2, Omega]."""
    a, theta, i, q1, q2, node = values
    omega = math.atan2(q2, q1)
    return state_from_elements(Elements(a, math.hypot(q1, q2), i, node, omega, theta - omega))


@given(orbits)
@pytest.mark.covers(
    "Joshi (3.49)-(3.56)",
    "relative/element_differences.py",
    "relative/gim_alfriend.py",
    differs="(3.54) has the wrong sign",
)
def test_sigma_is_the_derivative_of_the_relative_state(elements):
    e, omega = elements.eccentricity, elements.argument_of_perigee
    values = np.array(
        [
            elements.semi_major_axis,
            omega + elements.true_anomaly,
            elements.inclination,
            e * math.cos(omega),
            e * math.sin(omega),
            elements.right_ascension,
        ]
    )
    chief = inertial_of(values)
    for column, step in zip(sigma(elements).T, np.diag([10.0, *[1e-6] * 5]), strict=True):
        ahead, behind = (relative_from_inertial(chief, inertial_of(values + sign * step)) for sign in (1, -1))
        difference = (ahead - behind) / (2.0 * np.linalg.norm(step))
        size = 1.0 if step[0] else elements.semi_major_axis
        # Rounding of the inertial states over the step, and the step squared.
        np.testing.assert_allclose(difference[:3], column[:3], atol=1e-8 * size)
        np.testing.assert_allclose(difference[3:], column[3:], atol=1e-7 * size * elements.mean_motion)


@settings(max_examples=15)
@given(orbits, st.floats(0.0, 5.0))
def test_transition_solves_the_variational_equations(elements, turns):
    model = GimAlfriendModel(elements)
    duration = turns * model.period
    chief = model.chief.inertial(0.0)
    steps = max(1, math.ceil(duration / model.longest_step))
    later, inertial = propagate_with_transition(chief, np.zeros(3), duration, steps)
    exact = scaled(elements, hill_transform(later) @ inertial @ hill_transform_inverse(chief))
    strength = J2 * (EARTH_RADIUS / elements.perigee_radius) ** 2
    ours = scaled(elements, model.transition(0.0, duration))
    # A theory of first order leaves the square of J2; without J2 the error would be of the first power.
    np.testing.assert_allclose(ours, exact, atol=60.0 * strength**2 * np.abs(exact).max() + 1e-11)


@pytest.mark.thorough
def test_error_falls_with_the_square_of_j2():
    # J2 (Re / a)^2 is four times smaller at twice the radius, its square sixteen times.
    errors = []
    for axis in (7e6, 1.4e7):
        model = GimAlfriendModel(Elements(axis, 0.05, 1.0, 0.3, 0.4, 0.5))
        exact = scaled(model.elements, OblateModel(model.chief).transition(0.0, 2.0 * model.period))
        ours = scaled(model.elements, model.transition(0.0, 2.0 * model.period))
        errors.append(np.abs(ours - exact).max())
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)


@pytest.mark.thorough
def test_transition_improves_on_tschauner_hempel_by_the_order_of_j2():
    elements = Elements(8e6, 0.1, 1.0, 0.3, 0.4, 0.5)
    model = GimAlfriendModel(elements)
    duration = 2.0 * model.period
    exact = scaled(elements, OblateModel(model.chief).transition(0.0, duration))
    size = np.abs(exact).max()
    errors = [
        np.abs(scaled(elements, other.transition(0.0, duration)) - exact).max() / size
        for other in (model, TschaunerHempelModel(KeplerChief.of(elements)))
    ]
    assert errors[0] < 5e-6
    assert errors[1] > 1e-3


@settings(max_examples=15)
@given(orbits, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_transition_is_a_group_to_the_order_of_the_theory(elements, first, second):
    model = GimAlfriendModel(elements)
    one, two = first * model.period, second * model.period
    whole = scaled(elements, model.transition(0.0, one + two))
    parts = scaled(elements, model.transition(one, two)) @ scaled(elements, model.transition(0.0, one))
    strength = J2 * (EARTH_RADIUS / elements.perigee_radius) ** 2
    np.testing.assert_allclose(parts, whole, atol=50.0 * strength**2 * np.abs(whole).max() + 1e-11)


def test_transition_over_zero_time_is_the_identity():
    model = GimAlfriendModel(Elements(8e6, 0.1, 1.0, 0.3, 0.4, 0.5))
    np.testing.assert_allclose(scaled(model.elements, model.transition(100.0, 0.0)), np.eye(6), atol=1e-13)


def test_bounded_start_agrees_with_the_nonlinear_condition():
    model = GimAlfriendModel(Elements(8e6, 0.1, 1.0, 0.3, 0.4, 0.5))
    differences = []
    for size in (1.0, 2.0):
        state = size * np.array([100.0, 200.0, -50.0, 0.1, -0.2, 0.05])
        differences.append(model.bounded(0.0, state)[4] - OblateModel(model.chief).bounded(0.0, state)[4])
    # The condition is the same but for second order in the separation: n s^2 / r.
    assert abs(differences[0]) < 1e-5
    assert differences[1] / differences[0] == pytest.approx(4.0, rel=1e-2)


def test_transition_far_out_tends_to_the_two_body_problem():
    # Far out J2 fades as r^-2: the matrix tends to Yamanaka and Ankersen's.
    differences = []
    for axis in (4e7, 8e7):
        elements = Elements(axis, 0.2, 1.0, 0.3, 0.4, 0.5)
        ours = scaled(elements, GimAlfriendModel(elements).transition(0.0, elements.period))
        other = scaled(elements, TschaunerHempelModel(KeplerChief.of(elements)).transition(0.0, elements.period))
        differences.append(np.abs(ours - other).max())
    assert differences[0] / differences[1] == pytest.approx(4.0, rel=0.05)


def test_equatorial_chief_is_rejected_by_name():
    with pytest.raises(OrbitError, match="inclination"):
        GimAlfriendModel(Elements(4.2e7, 0.0, 0.0, 0.0, 0.0, 0.0))


def test_input_matrix_is_that_of_the_integrated_equations():
    model = GimAlfriendModel(Elements(8e6, 0.1, 1.0, 0.3, 0.4, 0.5))
    _, ours = model.discretise(100.0, 60.0)
    _, exact = RelativeModel.discretise(OblateModel(model.chief), 100.0, 60.0)
    np.testing.assert_allclose(ours, exact, rtol=1e-9, atol=1e-12)
