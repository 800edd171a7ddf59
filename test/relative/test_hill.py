"""Hill's equations against their right-hand side, conservation laws and printed closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from formation_gnc.errors import OrbitError
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import INPUT, integrate

motions = st.floats(7e-5, 1.2e-3)  # GEO to the lowest orbits
durations = st.floats(-2e4, 2e4)


@given(motions, st.floats(-25.0, 25.0), st.floats(-1e4, 1e4))
@pytest.mark.covers("Roberts (9)", "relative/hill.py")
def test_discretisation_is_the_matrix_exponential(mean_motion, angle, later):
    # Compared in units of 1 / n, where all entries are of one size.
    joint = np.zeros((9, 9))
    joint[:6, :6] = HillModel(1.0).dynamics()
    joint[:6, 6:] = INPUT
    expected = expm(joint * angle)
    free, forced = HillModel(mean_motion).discretise(later, angle / mean_motion)
    unit = np.repeat([1.0, mean_motion], 3)
    # The exponential's own error over four orbits, relative to its largest entry.
    tolerance = 1e-11 * np.abs(expected).max()
    np.testing.assert_allclose(free * unit / unit[:, None], expected[:6, :6], rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(forced * mean_motion**2 / unit[:, None], expected[:6, 6:], rtol=0.0, atol=tolerance)


@given(motions, durations, durations)
def test_transition_is_a_group_of_unit_determinant(mean_motion, first, second):
    model = HillModel(mean_motion)
    whole = model.transition(0.0, first + second)
    np.testing.assert_allclose(
        model.transition(first, second) @ model.transition(0.0, first),
        whole,
        atol=1e-10 * np.abs(whole).max(),
    )
    assert np.linalg.det(model.transition(0.0, first)) == pytest.approx(1.0, rel=1e-6)


def test_discretisation_of_a_short_tick_has_full_precision():
    # A millisecond: naive angle - sin(angle) would leave no correct digit. The Taylor terms are exact here.
    n, tick = 1e-3, 1e-3
    free, forced = HillModel(n).discretise(0.0, tick)
    assert free[1, 0] == pytest.approx(-((n * tick) ** 3), rel=1e-12, abs=0.0)
    assert forced[0, 1] == pytest.approx(n * tick**3 / 3.0, rel=1e-12, abs=0.0)
    assert forced[1, 0] == pytest.approx(-n * tick**3 / 3.0, rel=1e-12, abs=0.0)
    np.testing.assert_allclose(np.diag(forced[:3]), tick**2 / 2.0, rtol=1e-9)


@given(motions, st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6))
def test_energy_integral_is_conserved(mean_motion, numbers):
    # Jacobi integral of Hill's equations: (v^2 - 3 n^2 x^2 + n^2 z^2) / 2.
    model = HillModel(mean_motion)
    state = np.array(numbers) * np.repeat([1.0, mean_motion], 3)
    states = model.propagate(0.0, state, np.linspace(0.0, 10 * 2 * np.pi / mean_motion, 50))
    scaled = states / np.repeat([1.0, mean_motion], 3)
    energy = np.sum(scaled[:, 3:] ** 2, axis=1) - 3.0 * scaled[:, 0] ** 2 + scaled[:, 2] ** 2
    np.testing.assert_allclose(energy, energy[0], atol=1e-9 * np.sum(scaled[0] ** 2) + 1e-12)


@given(motions, st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6))
def test_bounded_motion_closes_after_one_orbit(mean_motion, numbers):
    model = HillModel(mean_motion)
    state = model.bounded(0.0, np.array(numbers) * np.repeat([1.0, mean_motion], 3))
    after = model.propagate(0.0, state, 2.0 * np.pi / mean_motion)
    np.testing.assert_allclose(after[:3], state[:3], atol=1e-9 * np.abs(numbers).max() + 1e-12)
    assert state[3] == numbers[3] * mean_motion


@pytest.mark.covers("Kremmydas 1.1.3, closed form; Listing: FreeDriftFormations: free drift", "relative/hill.py")
def test_closed_form_under_constant_thrust_is_the_printed_one():
    # Kremmydas section 1.1.3, in its axes: x along-track, y against the normal, z to Earth.
    omega, t = 1.0618e-3, 2345.0
    x0, y0, z0, dx0, dy0, dz0 = 120.0, -70.0, 35.0, 0.02, -0.04, 0.03
    gx, gy, gz = 3e-5, -2e-5, 4e-5
    s, c = np.sin(omega * t), np.cos(omega * t)
    x = (4 * dx0 / omega - 6 * z0) * s - 2 * dz0 / omega * c + (6 * omega * z0 - 3 * dx0) * t
    x += x0 + 2 * dz0 / omega + gz * 2 / omega**2 * (omega * t - s) + gx * (4 / omega**2 * (1 - c) - 1.5 * t**2)
    y = y0 * c + dy0 / omega * s + gy / omega**2 * (1 - c)
    z = (2 * dx0 / omega - 3 * z0) * c + dz0 / omega * s + 4 * z0 - 2 * dx0 / omega
    z += gx * 2 / omega**2 * (s - omega * t) + gz / omega**2 * (1 - c)
    ours = HillModel(omega).propagate(0.0, np.array([-z0, x0, -y0, -dz0, dx0, -dy0]), t, np.array([-gz, gx, -gy]))
    np.testing.assert_allclose(ours[:3], [-z, x, -y], rtol=1e-12)


def test_arrays_of_durations_and_states_give_single_results():
    model = HillModel(1.1e-3)
    times = np.array([0.0, 10.0, 700.0])
    states = np.arange(18.0).reshape(3, 6)
    thrust = np.array([1e-4, 2e-4, -1e-4])
    together = model.propagate(0.0, states, times, thrust)
    for index, time in enumerate(times):
        np.testing.assert_array_equal(together[index], model.propagate(0.0, states[index], float(time), thrust))


@pytest.mark.covers("Neokleous (1.12), (1.13)", "relative/hill.py")
def test_integration_of_the_right_hand_side_gives_the_closed_form():
    # The integrator of models without a closed form, in steps of 1/190 orbit.
    model = HillModel(1.1e-3)
    state = np.array([100.0, -200.0, 50.0, 0.1, -0.2, 0.05])
    thrust = np.array([1e-4, -2e-4, 3e-4])
    numeric = integrate(lambda t, x: model.derivative(t, x, thrust), 0.0, state, 6000.0, 30.0)
    np.testing.assert_allclose(numeric, model.propagate(0.0, state, 6000.0, thrust), rtol=1e-12)


@pytest.mark.parametrize("value", [0.0, -1e-3, np.nan, np.inf])
def test_invalid_mean_motion_is_rejected_by_name(value):
    with pytest.raises(OrbitError, match="mean_motion"):
        HillModel(value)
