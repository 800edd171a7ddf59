"""Factorisations A(x) x against the equations as written, in the Hill frame and as the source prints them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.orbit.gravity import acceleration as gravity
from formation_gnc.relative.chief import ChiefState, KeplerChief, OblateChief
from formation_gnc.relative.factorisation import oblateness, sdc1, sdc2
from formation_gnc.relative.nonlinear import jacobian
from formation_gnc.relative.oblate import OblateModel, oblate_gradient

sdc1_oblate = OblateModel(KeplerChief(8e6)).factorised

chiefs = st.builds(
    KeplerChief,
    semi_major_axis=st.floats(2.3e7, 4.5e7),
    eccentricity=st.floats(0.0, 0.7),
    inclination=st.floats(0.0, math.pi),
    argument_of_perigee=st.floats(0.0, 6.28),
    true_anomaly=st.floats(0.0, 6.28),
)
times = st.floats(0.0, 1e5)
states = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(
    lambda numbers: np.array(numbers) * np.repeat([5e5, 500.0], 3)
)


def printed(state, chief, rate_of_change):
    """Joshi (3.22) with the sign of the y equation's Coriolis term corrected, written out."""
    x, y, z, vx, vy, vz = state
    r, w = chief.radius, chief.angular_rate
    gamma = ((r + x) ** 2 + y**2 + z**2) ** 1.5
    return np.array(
        [
            vx,
            vy,
            vz,
            2 * w * vy + rate_of_change * y + w**2 * x - MU * (r + x) / gamma + MU / r**2,
            -2 * w * vx - rate_of_change * x + w**2 * y - MU * y / gamma,
            -MU * z / gamma,
        ]
    )


@given(chiefs, times, states)
def test_sdc1_equals_the_nonlinear_equations(chief, time, state):
    here = chief.at(time)
    expected = printed(state, here, here.angular_acceleration)
    # The printed form subtracts two terms of MU / r^2: that rounding is the tolerance.
    np.testing.assert_allclose(sdc1(state, here) @ state, expected, rtol=1e-13, atol=4e-15 * MU / here.radius**2)


@given(chiefs, times, states)
def test_sdc2_equals_the_circular_equations_at_the_chiefs_rate(chief, time, state):
    here = chief.at(time)
    x, y, z, vx, vy, vz = state
    r, w = here.radius, here.angular_rate
    sigma = r**3 / ((r + x) ** 2 + y**2 + z**2) ** 1.5  # Joshi (3.27), (5.28)-(5.30)
    expected = [
        vx,
        vy,
        vz,
        2 * w * vy + w**2 * (r + x) * (1 - sigma),
        -2 * w * vx + w**2 * y * (1 - sigma),
        -(w**2) * z * sigma,
    ]
    np.testing.assert_allclose(sdc2(state, here) @ state, expected, rtol=1e-13, atol=4e-15 * w**2 * r)


@given(chiefs, times, states)
def test_j2_factorisation_is_the_difference_of_two_accelerations(chief, time, state):
    here = chief.at(time)
    # The same place in a frame whose third axis is the pole: any one will do, J2 is symmetric about it.
    axis = np.cross(here.pole, [1.0, 0.0, 0.0] if abs(here.pole[0]) < 0.9 else [0.0, 1.0, 0.0])
    axis /= np.linalg.norm(axis)
    inertial = np.array([axis, np.cross(here.pole, axis), here.pole])

    def oblate(place):
        x = inertial @ place
        return inertial.T @ (gravity(x) + MU * x / np.linalg.norm(x) ** 3)

    chief_place = np.array([here.radius, 0.0, 0.0])
    expected = oblate(chief_place + state[:3]) - oblate(chief_place)
    # The reference adds and removes the central attraction: 2e-15 of it is its rounding.
    tolerance = 4e-15 * MU / min(here.radius, np.linalg.norm(chief_place + state[:3])) ** 2
    np.testing.assert_allclose(oblateness(state, here) @ state[:3], expected, rtol=1e-9, atol=tolerance)
    whole = sdc1_oblate(state, here) - sdc1(state, here)
    np.testing.assert_allclose(whole[3:, :3], oblateness(state, here), atol=1e-12 * abs(whole).max() + 1e-20)


@given(chiefs, times)
def test_on_the_chief_the_factorisation_is_the_jacobian(chief, time):
    # At x = 0 a smooth factorisation is unique: its limit is the derivative of f.
    here, still = chief.at(time), np.zeros(6)
    np.testing.assert_allclose(sdc1(still, here), jacobian(still, here), rtol=1e-13, atol=1e-22)
    np.testing.assert_allclose(oblateness(still, here), oblate_gradient(still, here), rtol=1e-9, atol=1e-19)


@pytest.mark.covers(
    "Joshi (5.28)-(5.33)",
    "relative/factorisation.py",
    differs="(5.31), (5.32) divide by x: the numerator is spread over the axes",
)
def test_sdc2_is_regular_at_zero_radial_separation():
    # The printed sigma_x = (r / x + 1) sigma_y grows without bound as x goes to 0 at y = 25 km.
    chief = KeplerChief(1e7).at(0.0)
    beside = [sdc2(np.array([x, 25e3, 10e3, 0, 0, 0]), chief)[3] for x in (-1e-6, 0.0, 1e-6)]
    np.testing.assert_allclose(beside[0], beside[1], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(beside[2], beside[1], rtol=1e-9, atol=1e-15)
    sigma_y = 1.0 - (1.0 + (25e3**2 + 10e3**2) / 1e14) ** -1.5
    assert (1e7 / 1e-6 + 1.0) * sigma_y > 1e7  # the printed entry over w^2, against 3 for Hill's equations


@given(chiefs, times)
@pytest.mark.covers("Joshi (3.27)-(3.37)", "relative/hill.py")
def test_sdc1_and_sdc2_near_a_circular_chief_are_hills_equations(chief, time):
    circular = KeplerChief(chief.semi_major_axis).at(time)
    w = circular.angular_rate
    for factorisation in (sdc1, sdc2):
        matrix = factorisation(np.array([1e-3, 1e-3, 1e-3, 0, 0, 0]), circular)
        assert matrix[3, 0] == pytest.approx(3.0 * w**2, rel=1e-8, abs=0.0)
        assert abs(matrix[4, 1]) < 1e-8 * w**2
        assert matrix[5, 2] == pytest.approx(-(w**2), rel=1e-8, abs=0.0)


def test_arrays_of_states_give_the_single_matrices():
    chief = OblateChief(Elements(7e6, 0.01, 1.0, 0.0, 0.3, 0.2)).at(100.0)
    states_ = np.arange(12.0).reshape(2, 6) * 1e3
    for factorisation in (sdc1, sdc2, sdc1_oblate):
        together = factorisation(states_, chief)
        for state, matrix in zip(states_, together, strict=True):
            np.testing.assert_allclose(factorisation(state, chief), matrix, rtol=1e-13, atol=1e-20)


def test_pole_of_an_oblate_chief_is_the_earths_axis():
    chief = OblateChief(Elements(7e6, 0.01, 1.0, 0.5, 0.3, 0.2))
    here = chief.at(1234.0)
    assert isinstance(here, ChiefState)
    np.testing.assert_allclose(hill_rotation(chief.inertial(1234.0)) @ [0.0, 0.0, 1.0], here.pole, atol=1e-15)


@pytest.mark.parametrize("factorise", [sdc1, sdc2, sdc1_oblate])
def test_arrays_of_states_and_chiefs_give_the_single_matrices(factorise):
    chief = OblateChief(Elements(8.0e6, 0.1, 0.9, 0.3, 0.4, 0.5))
    times = np.linspace(0.0, 5000.0, 7)
    states = np.random.default_rng(3).standard_normal((7, 6)) * np.repeat([5e4, 50.0], 3)
    together = factorise(states, chief.along(times))
    one_by_one = [factorise(state, chief.at(time)) for state, time in zip(states, times, strict=True)]
    np.testing.assert_allclose(together, one_by_one, rtol=1e-14, atol=0.0)
