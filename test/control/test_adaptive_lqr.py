"""LQR with networks that learn what its model leaves out."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.adaptive_lqr import (
    FARTHEST,
    LARGEST_WEIGHT,
    AdaptiveLinearQuadraticRegulator,
    AdaptiveLqrParameters,
)
from formation_gnc.control.controller import Handover
from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.networks import FORCED, Networks, Regulator, functions
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


def fly(law, model, estimate, target, start, ticks, disturbance=0.0, tick=10.0):
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


def test_the_law_starts_as_lqr(law, common, vehicle, estimate, target):
    state = np.array([10.0, -20.0, 5.0, 0.01, 0.0, -0.02])
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    force = law().command(estimate(state), target()).force
    gain = np.array(law().figures()["gain at the start [N/m, N/(m/s)]"])
    np.testing.assert_allclose(-gain @ state, force, rtol=1e-9)
    np.testing.assert_allclose(force, plain.command(estimate(state), target()).force, rtol=1e-9)


def test_a_constant_acceleration_is_identified_with_a_double_pole():
    """d - d_hat = d (1 + t / T) exp(-t / T) when the functions do not change."""
    networks, d, tick, time = Networks(double_integrator(), 5.0, 0.1), np.array([0.3, -0.2, 0.1]), 0.01, 5.0
    values, slopes = functions(np.zeros(6), 1e5, 0.4)
    error = np.zeros(6)
    networks.meet(error)
    left = []
    for _ in range(2000):
        networks.identify(error, values, slopes, tick)
        left.append(d - values @ networks.model_weights)
        networks.fly(error, values, np.zeros(3), tick)
        error = error + tick * np.concatenate([error[3:], d])
        error[:3] = 0.0  # what matters here is the velocity alone
    t = tick * np.arange(1, 2001) / time
    expected = ((1.0 + t) * np.exp(-t))[:, None] * d
    assert np.abs(np.array(left) - expected).max() < 0.01 * np.abs(d).max()  # Euler's steps: tick / time


def test_the_costate_becomes_that_of_the_optimum_under_a_constant_acceleration():
    """There A' lambda + ... = 0 has the solution lambda = -(A - G P)^-T P B d, G = B R^-1 B'."""
    regulator, d, tick = double_integrator(), np.array([0.3, -0.2, 0.1]), 0.02
    networks = Networks(regulator, 1.0, 0.01)
    error = np.array([0.5, -0.5, 0.5, 0.0, 0.0, 0.0])
    networks.meet(error)
    values, slopes = np.zeros(14), np.zeros((14, 6))
    values[0] = 1.0  # what there is to learn is a constant
    for _ in range(3000):
        networks.identify(error, values, slopes, tick)
        thrust = networks.thrust(error)
        following = networks.fly(error, values, thrust, tick)
        networks.teach(error, following, slopes, tick)
        error = error + tick * np.concatenate([error[3:], thrust + d])
    closed = regulator.dynamics - FORCED.T @ FORCED @ regulator.cost_to_go
    expected = -np.linalg.solve(closed.T, regulator.cost_to_go @ FORCED.T @ d)
    np.testing.assert_allclose(networks.costate(error), expected, atol=0.02 * np.abs(expected).max())
    assert np.linalg.norm(error) < 0.02 * np.linalg.norm(np.linalg.solve(closed, FORCED.T @ d))


def test_slopes_are_the_derivatives_of_the_functions():
    state, radius = np.array([3.0, -2.0, 1.0, 0.5, 0.3, -0.2]), 40.0
    _, slopes = functions(state, radius, 0.7)
    for column, amount in enumerate(1e-5 * np.eye(6)):
        ends = [functions(state + sign * amount, radius, 0.7)[0] for sign in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, column], (ends[0] - ends[1]) / 2e-5, atol=1e-8)


def test_under_a_constant_disturbance_it_settles_near_where_the_optimum_does(law, common, vehicle, estimate, target):
    """u = -K x - R^-1 B' w with w = -(A - B K)^-T P B d, and x' = 0."""
    model, push, flying = HillModel(common.mean_motion), np.array([2e-6, -1e-6, 1e-6]), law()
    plain = LinearQuadraticRegulator(LqrParameters(**ROBERTS), common, vehicle)
    left, _ = fly(plain, model, estimate, target, np.zeros(6), 800, push)
    learnt, _ = fly(flying, model, estimate, target, np.zeros(6), 800, push)
    a, b, p = model.dynamics(0.0), model.INPUT, flying.cost_to_go
    softness = np.linalg.inv(100.0**2 * AdaptiveLqrParameters(**ROBERTS).thrust_matrix())
    closed = a - b @ softness @ b.T @ p
    costate = -np.linalg.solve(closed.T, p @ b @ push)
    expected = -np.linalg.solve(closed, b @ (push - softness @ b.T @ costate))
    assert np.linalg.norm(expected[:3]) < 0.5 * np.linalg.norm(left[-1, :3])
    # Near: what does not move cannot be told apart, so that a part of it is put down to the state.
    np.testing.assert_allclose(learnt[-1, :3], expected[:3], atol=0.35 * np.linalg.norm(expected[:3]))


def test_about_a_chief_on_another_orbit_than_believed_the_error_is_smaller(vehicle, estimate, target):
    """Baseline: circular, 10 % low. Truth: e = 0.3; the target is a place that no free orbit keeps."""
    believed = CommonParameters(Orbit(9e6), tick=10.0)
    model = NonlinearModel(KeplerChief(1e7, 0.3))
    away = np.array([0.0, -100.0, 0.0, 0.0, 0.0, 0.0])
    errors = []
    for flying in (
        LinearQuadraticRegulator(LqrParameters(**ROBERTS), believed, vehicle),
        AdaptiveLinearQuadraticRegulator(AdaptiveLqrParameters(**ROBERTS), believed, vehicle),
    ):
        states, _ = fly(flying, model, estimate, lambda state=away, time=0.0: target(state, time), away, 2000)
        errors.append(np.sqrt(np.mean(np.sum((states[500:, :3] - away[:3]) ** 2, axis=1))))
    assert errors[1] < 0.7 * errors[0]  # d passes by as fast as lambda is learnt


@pytest.mark.parametrize("network", ["model_weights", "costate_weights"])
@pytest.mark.parametrize("weight", [2.0 * LARGEST_WEIGHT, -2.0 * LARGEST_WEIGHT, np.inf, np.nan])
def test_weights_that_blow_up_are_named_and_lqr_flies_from_then_on(
    network, weight, law, common, vehicle, estimate, target
):
    flying, state = law(), np.array([10.0, -20.0, 5.0, 0.01, 0.0, -0.02])
    flying.command(estimate(state), target())
    weights = getattr(flying.networks, network)
    weights[0, 0] = weight
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    for tick in (1, 2):
        with np.errstate(all="ignore"):
            command = flying.command(estimate(state, 10.0 * tick), target(time=10.0 * tick))
        assert "network weights have blown up to" in command.fallback
        assert command.fallback.endswith("LQR flies")
        np.testing.assert_allclose(command.force, plain.command(estimate(state), target()).force, rtol=1e-9)
    new = law()
    new.activate(Handover(np.zeros(3), "adaptive_lqr", flying))
    assert not new.command(estimate(state), target()).fallback


def test_an_estimate_out_of_any_range_undoes_nothing(law, common, vehicle, estimate, target):
    flying, push = law(), np.array([2e-6, -1e-6, 1e-6])
    state = fly(flying, HillModel(common.mean_motion), estimate, target, np.zeros(6), 300, push)[0][-1]
    known = flying.networks.model_weights
    far = np.full(6, 10.0 * FARTHEST)
    plain = LinearQuadraticRegulator(LqrParameters(gain="continuous", **ROBERTS), common, vehicle)
    command = flying.command(estimate(far, 3000.0), target(time=3000.0))
    assert command.fallback == "adaptive_lqr: the error is out of any range; LQR flies"
    np.testing.assert_allclose(command.force, plain.command(estimate(far), target()).force, rtol=1e-9)
    np.testing.assert_array_equal(flying.networks.model_weights, known)
    command = flying.command(estimate(state, 3010.0), target(time=3010.0))
    assert not command.fallback
    np.testing.assert_array_equal(flying.networks.model_weights, known)  # met anew: nothing to learn from yet
    with np.errstate(all="ignore"):
        plain_force = plain.command(estimate(state), target()).force
    assert np.linalg.norm(command.force - plain_force) > 1e-5  # what it knew is flown


def test_new_parameters_keep_what_was_learnt(law, common, estimate, target):
    flying, push = law(), np.array([2e-6, -1e-6, 1e-6])
    fly(flying, HillModel(common.mean_motion), estimate, target, np.zeros(6), 300, push)
    new, other = law(inertia=0.2), law(reach=50.0)
    for each in (new, other):
        each.activate(Handover(np.zeros(3), "adaptive_lqr", flying))
    np.testing.assert_array_equal(new.networks.model_weights, flying.networks.model_weights)
    assert not other.networks.model_weights.any()  # other units


def test_a_leap_of_the_target_is_not_taken_for_an_acceleration(law, common, estimate, target):
    model, flying = HillModel(common.mean_motion), law(reach=1000.0)
    fly(flying, model, estimate, target, np.zeros(6), 50)
    assert np.abs(flying.networks.model_weights).max() < 1e-9
    leap = target(np.array([0.0, 50.0, 0.0, 0.0, 0.2, 0.0]), time=500.0)
    flying.command(estimate(np.zeros(6), 500.0), leap)
    assert np.abs(flying.networks.model_weights).max() < 1e-9


def test_learning_too_brisk_for_the_tick_is_rejected(law, common, vehicle):
    with pytest.raises(DesignError, match="at least 5 ticks"):
        law(identification_time=40.0)
    with pytest.raises(DesignError, match="adaptive_lqr: state_weight has 2 values"):
        law(state_weight=(1.0, 2.0))


numbers = st.floats(-1e200, 1e200)


@settings(max_examples=60, deadline=None)
@given(
    states=st.lists(st.lists(numbers, min_size=6, max_size=6), min_size=4, max_size=4),
    inertia=st.floats(0.0, 10.0),
    reach=st.floats(1e-3, 1e6),
)
def test_whatever_comes_in_a_finite_force_within_the_limit_comes_out(states, inertia, reach, estimate, target):
    values = {"chief.semi_major_axis": 7.5e6, "tick": 10.0, "algorithm": "adaptive_lqr"}
    values |= {"adaptive_lqr.inertia": inertia, "adaptive_lqr.reach": reach}
    pilot = ControllerManager("controller", load(ControllerParameters, values))
    for tick in range(4):
        seen, aim = estimate(states[tick], 10.0 * tick), target(states[tick // 2], 10.0 * tick)
        thrust, status = pilot.on_tick(dataclasses.replace(seen), aim)
        assert np.isfinite(thrust.force).all()
        assert (np.abs(thrust.force) <= 0.01).all()
        assert np.isfinite(status.demand).all()
