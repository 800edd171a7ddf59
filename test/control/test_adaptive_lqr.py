"""Adaptive LQR: identification, costate and divergence of its networks."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.adaptive_lqr import (
    MAX_ERROR,
    MAX_WEIGHT,
    AdaptiveLinearQuadraticRegulator,
    AdaptiveLqrParameters,
)
from formation_gnc.control.controller import Handover
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.networks import FORCED, Networks, Regulator, basis_functions
from formation_gnc.errors import DesignError
from formation_gnc.parameters import load
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.nonlinear import NonlinearModel

ROBERTS = {"position_error": (10.0,) * 3, "velocity_error": (0.1,) * 3, "thrust": (0.002,) * 3}


@pytest.fixture(scope="module")
def law(common, vehicle):
    return lambda **changes: AdaptiveLinearQuadraticRegulator(
        AdaptiveLqrParameters(**(ROBERTS | changes)), common, vehicle
    )


def simulate(law, model, estimate, target, start, ticks, disturbance=0.0, tick=10.0):
    states, forces = [np.asarray(start, dtype=float)], []
    for index in range(ticks):
        time = index * tick
        forces.append(np.clip(law.command(estimate(states[-1], time), target(time=time)).force, -0.01, 0.01))
        states.append(model.propagate(time, states[-1], tick, forces[-1] / 100.0 + disturbance))
    return np.array(states), np.array(forces)


def double_integrator():
    dynamics = np.zeros((6, 6))
    dynamics[:3, 3:] = np.eye(3)
    cost_to_go = solve_continuous_are(dynamics, FORCED.T, np.eye(6), np.eye(3))
    return Regulator(dynamics, np.eye(6), np.eye(3), cost_to_go)


@pytest.mark.covers("Joshi (8.1)-(8.5)", "control/adaptive_lqr.py", "control/networks.py")
def test_with_zero_weights_the_law_is_lqr(law, common, vehicle, estimate, target):
    state = np.array([10.0, -20.0, 5.0, 0.01, 0.0, -0.02])
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    force = law().command(estimate(state), target()).force
    gain = np.array(law().figures()["initial gain [N/m, N/(m/s)]"])
    np.testing.assert_allclose(-gain @ state, force, rtol=1e-9)
    np.testing.assert_allclose(force, plain.command(estimate(state), target()).force, rtol=1e-9)


@pytest.mark.covers("Joshi (8.9)-(8.18)", "control/networks.py")
def test_a_constant_acceleration_is_identified_with_a_double_pole():
    """d - d_hat = d (1 + t / T) exp(-t / T) for constant basis functions."""
    networks, d, tick, time = Networks(double_integrator(), 5.0, 0.1), np.array([0.3, -0.2, 0.1]), 0.01, 5.0
    basis, gradients = basis_functions(np.zeros(6), 1e5, 0.4)
    error = np.zeros(6)
    networks.reset_observer(error)
    left = []
    for _ in range(2000):
        networks.identify(error, basis, gradients, tick)
        left.append(d - basis @ networks.model_weights)
        networks.predict(error, basis, np.zeros(3), tick)
        error = error + tick * np.concatenate([error[3:], d])
        error[:3] = 0.0  # only the velocity matters here
    t = tick * np.arange(1, 2001) / time
    expected = ((1.0 + t) * np.exp(-t))[:, None] * d
    assert np.abs(np.array(left) - expected).max() < 0.01 * np.abs(d).max()  # Euler's method: order tick / time


@pytest.mark.covers("Joshi (8.28)-(8.30)", "control/networks.py", differs="(8.28) has Q for R")
def test_the_costate_converges_to_the_optimum_at_constant_acceleration():
    """The stationary optimum is lambda = -(A - G P)^-T P B d, G = B R^-1 B'."""
    regulator, d, tick = double_integrator(), np.array([0.3, -0.2, 0.1]), 0.02
    networks = Networks(regulator, 1.0, 0.01)
    error = np.array([0.5, -0.5, 0.5, 0.0, 0.0, 0.0])
    networks.reset_observer(error)
    basis, gradients = np.zeros(14), np.zeros((14, 6))
    basis[0] = 1.0  # the constant term alone
    for _ in range(3000):
        networks.identify(error, basis, gradients, tick)
        thrust = networks.thrust(error)
        following = networks.predict(error, basis, thrust, tick)
        networks.train(error, following, gradients, tick)
        error = error + tick * np.concatenate([error[3:], thrust + d])
    closed = regulator.dynamics - FORCED.T @ FORCED @ regulator.cost_to_go
    expected = -np.linalg.solve(closed.T, regulator.cost_to_go @ FORCED.T @ d)
    np.testing.assert_allclose(networks.costate(error), expected, atol=0.02 * np.abs(expected).max())
    assert np.linalg.norm(error) < 0.02 * np.linalg.norm(np.linalg.solve(closed, FORCED.T @ d))


def test_gradients_are_the_derivatives_of_the_basis_functions():
    state, radius = np.array([3.0, -2.0, 1.0, 0.5, 0.3, -0.2]), 40.0
    _, gradients = basis_functions(state, radius, 0.7)
    for column, amount in enumerate(1e-5 * np.eye(6)):
        ends = [basis_functions(state + sign * amount, radius, 0.7)[0] for sign in (1.0, -1.0)]
        np.testing.assert_allclose(gradients[:, column], (ends[0] - ends[1]) / 2e-5, atol=1e-8)


def test_a_constant_disturbance_leaves_nearly_the_optimal_offset(law, common, vehicle, estimate, target):
    """u = -K x - R^-1 B' w with w = -(A - B K)^-T P B d, and x' = 0."""
    model, push, adaptive = HillModel(common.mean_motion), np.array([2e-6, -1e-6, 1e-6]), law()
    plain = LinearQuadraticRegulator(LqrParameters(**ROBERTS), common, vehicle)
    left, _ = simulate(plain, model, estimate, target, np.zeros(6), 800, push)
    learnt, _ = simulate(adaptive, model, estimate, target, np.zeros(6), 800, push)
    a, b, p = model.dynamics(0.0), model.INPUT, adaptive.cost_to_go
    softness = np.linalg.inv(100.0**2 * AdaptiveLqrParameters(**ROBERTS).thrust_matrix())
    closed = a - b @ softness @ b.T @ p
    costate = -np.linalg.solve(closed.T, p @ b @ push)
    expected = -np.linalg.solve(closed, b @ (push - softness @ b.T @ costate))
    assert np.linalg.norm(expected[:3]) < 0.5 * np.linalg.norm(left[-1, :3])
    # Only nearly: in steady state, part of the constant is attributed to the state (no excitation).
    np.testing.assert_allclose(learnt[-1, :3], expected[:3], atol=0.35 * np.linalg.norm(expected[:3]))


@pytest.mark.thorough
def test_a_wrong_chief_orbit_leaves_less_error_than_with_lqr(vehicle, estimate, target):
    """Model: circular, 10 % low. Truth: e = 0.3, with a fixed target that is not in free motion."""
    modelled = CommonParameters(Orbit(9e6), tick=10.0)
    model = NonlinearModel(KeplerChief(1e7, 0.3))
    away = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
    errors = []
    for adaptive in (
        LinearQuadraticRegulator(LqrParameters(**ROBERTS), modelled, vehicle),
        AdaptiveLinearQuadraticRegulator(AdaptiveLqrParameters(**ROBERTS), modelled, vehicle),
    ):
        states, _ = simulate(adaptive, model, estimate, lambda state=away, time=0.0: target(state, time), away, 1500)
        errors.append(np.sqrt(np.mean(np.sum((states[500:, :3] - away[:3]) ** 2, axis=1))))
    assert errors[1] < 0.7 * errors[0]  # d varies as fast as lambda is trained


@pytest.mark.parametrize("network", ["model_weights", "costate_weights"])
@pytest.mark.parametrize("weight", [2.0 * MAX_WEIGHT, -2.0 * MAX_WEIGHT, np.inf, np.nan])
def test_diverged_weights_are_reported_and_leave_lqr_active(network, weight, law, common, vehicle, estimate, target):
    adaptive, state = law(), np.array([10.0, -20.0, 5.0, 0.01, 0.0, -0.02])
    adaptive.command(estimate(state), target())
    weights = getattr(adaptive.networks, network)
    weights[0, 0] = weight
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    for tick in (1, 2):
        with np.errstate(all="ignore"):
            command = adaptive.command(estimate(state, 10.0 * tick), target(time=10.0 * tick))
        assert "network weights have diverged to" in command.fallback
        assert command.fallback.endswith("LQR active")
        np.testing.assert_allclose(command.force, plain.command(estimate(state), target()).force, rtol=1e-9)
    new = law()
    new.activate(Handover(np.zeros(3), "adaptive_lqr", adaptive))
    assert not new.command(estimate(state), target()).fallback


def test_an_estimate_out_of_range_leaves_the_weights_unchanged(law, common, vehicle, estimate, target):
    adaptive, push = law(), np.array([2e-6, -1e-6, 1e-6])
    state = simulate(adaptive, HillModel(common.mean_motion), estimate, target, np.zeros(6), 300, push)[0][-1]
    trained = adaptive.networks.model_weights
    far = np.full(6, 10.0 * MAX_ERROR)
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    command = adaptive.command(estimate(far, 3000.0), target(time=3000.0))
    assert command.fallback == "adaptive_lqr: error out of range; LQR active"
    np.testing.assert_allclose(command.force, plain.command(estimate(far), target()).force, rtol=1e-9)
    np.testing.assert_array_equal(adaptive.networks.model_weights, trained)
    command = adaptive.command(estimate(state, 3010.0), target(time=3010.0))
    assert not command.fallback
    np.testing.assert_array_equal(adaptive.networks.model_weights, trained)  # the observer has been reset
    with np.errstate(all="ignore"):
        plain_force = plain.command(estimate(state), target()).force
    assert np.linalg.norm(command.force - plain_force) > 1e-5  # the trained weights act


def test_new_parameters_keep_the_network_weights(law, common, estimate, target):
    adaptive, push = law(), np.array([2e-6, -1e-6, 1e-6])
    simulate(adaptive, HillModel(common.mean_motion), estimate, target, np.zeros(6), 300, push)
    new, other = law(inertia=0.2), law(reach=50.0)
    for each in (new, other):
        each.activate(Handover(np.zeros(3), "adaptive_lqr", adaptive))
    np.testing.assert_array_equal(new.networks.model_weights, adaptive.networks.model_weights)
    assert not other.networks.model_weights.any()  # other units


def test_a_jump_of_the_target_is_not_identified_as_an_acceleration(law, common, estimate, target):
    model, adaptive = HillModel(common.mean_motion), law(reach=1000.0)
    simulate(adaptive, model, estimate, target, np.zeros(6), 50)
    assert np.abs(adaptive.networks.model_weights).max() < 1e-9
    jump = target(np.array([0.0, 50.0, 0.0, 0.0, 0.2, 0.0]), time=500.0)
    adaptive.command(estimate(np.zeros(6), 500.0), jump)
    assert np.abs(adaptive.networks.model_weights).max() < 1e-9


def test_an_identification_time_too_short_for_the_tick_is_rejected(law, common, vehicle):
    with pytest.raises(DesignError, match="at least 5 ticks"):
        law(identification_time=40.0)
    with pytest.raises(DesignError, match="adaptive_lqr: state_weight has 2 values"):
        law(state_weight=(1.0, 2.0))


numbers = st.floats(-1e200, 1e200)


@settings(max_examples=60)
@given(
    states=st.lists(st.lists(numbers, min_size=6, max_size=6), min_size=4, max_size=4),
    inertia=st.floats(0.0, 10.0),
    reach=st.floats(1e-3, 1e6),
)
@pytest.mark.thorough
def test_any_input_gives_a_finite_force_within_the_limit(states, inertia, reach, estimate, target):
    values = {"chief.semi_major_axis": 7.5e6, "tick": 10.0, "algorithm": "adaptive_lqr"}
    values |= {"adaptive_lqr.inertia": inertia, "adaptive_lqr.reach": reach}
    manager = ControllerManager("controller", load(ControllerParameters, values))
    for tick in range(4):
        seen, aim = estimate(states[tick], 10.0 * tick), target(states[tick // 2], 10.0 * tick)
        thrust, status = manager.on_tick(dataclasses.replace(seen), aim)
        assert np.isfinite(thrust.force).all()
        assert (np.abs(thrust.force) <= 0.01).all()
        assert np.isfinite(status.demand).all()


def test_a_chief_that_is_too_eccentric_is_rejected(vehicle):
    """The networks follow a deviation from circular motion, not another motion."""
    law, parameters = AdaptiveLinearQuadraticRegulator, AdaptiveLqrParameters()
    law(parameters, CommonParameters(Orbit(1e7, eccentricity=0.2), tick=10.0), vehicle)
    with pytest.raises(DesignError, match=r"eccentricity is 0.4; it must be at most 0.2; lqr with .* tschauner_hempel"):
        law(parameters, CommonParameters(Orbit(1.2e7, eccentricity=0.4), tick=10.0), vehicle)
