"""Recovery from errors beyond the thrusters' limit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.recovery import SHARE, STARTS, RecoveryTrajectory, is_overasked, least_effort
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

LOW = Elements(6978100.0, 0.0, 1.48, 0.0, 0.0, 0.0)
HILL = HillModel(LOW.mean_motion)
TICK = 10.0


def trace(model, error, limit, time=0.0):
    """States (N, 6) and accelerations (N, 3) of the trajectory from an error."""
    trajectory = RecoveryTrajectory(model, TICK)
    trajectory.begin(np.asarray(error), limit, time)
    states, accelerations = [], []
    while trajectory.state is not None:
        states.append(trajectory.state)
        accelerations.append(trajectory.acceleration())
        trajectory.advance()
    return np.array(states[:-1]), np.array(accelerations[:-1])


position, speed = st.floats(-2e3, 2e3), st.floats(-1.0, 1.0)


@settings(max_examples=25, deadline=None)
@given(st.tuples(position, position, position, speed, speed, speed), st.floats(-4.5, -2.0))
@pytest.mark.thorough
def test_every_trajectory_stays_off_the_limit_and_ends_at_the_target(error, exponent):
    limit = np.full(3, 10.0**exponent)
    states, accelerations = trace(HILL, error, limit)
    assert np.abs(accelerations).max() <= SHARE * limit[0] * (1.0 + 1e-12)
    phi, gamma = HILL.discretise(0.0, TICK)
    np.testing.assert_allclose(states[1:], (states @ phi.T + accelerations @ gamma.T)[:-1], rtol=0.0, atol=1e-9)
    end = phi @ states[-1] + gamma @ accelerations[-1]
    # Quadrature of 32 nodes a revolution and the tick: thousandths of the way flown, and ten ticks' thrust.
    assert np.linalg.norm(end[:3]) <= 2e-2 * np.linalg.norm(states[:, :3], axis=1).max() + 1e4 * limit[0]


@pytest.mark.parametrize("missing", [0, 2])
def test_an_axis_without_thruster_takes_no_part(missing):
    limit = np.full(3, 1e-4)
    limit[missing] = 0.0
    states, accelerations = trace(HILL, [100.0, -200.0, 50.0, 0.0, 0.1, 0.0], limit)
    assert not accelerations[:, missing].any()
    assert np.abs(states[-1, :2]).max() < 5.0
    assert states[:, 2].any() == (missing != 2)


def test_about_an_ellipse_the_trajectory_is_that_of_its_model():
    model = TschaunerHempelModel.about(Elements(1.2e7, 0.4, 1.0, 0.0, 0.0, 0.5))
    states, accelerations = trace(model, [1000.0, -500.0, 300.0, 0.0, 0.0, 0.0], np.full(3, 5e-3))
    assert np.abs(accelerations).max() <= SHARE * 5e-3
    following = model.propagate(20 * TICK, states[20], TICK, accelerations[20])
    np.testing.assert_allclose(states[21], following, rtol=0.0, atol=1e-3)  # a w T^3 of a push in the middle
    assert np.linalg.norm(states[-1, :3]) < 20.0


def test_an_error_out_of_reach_is_not_tried_again_at_every_tick():
    trajectory, tried = RecoveryTrajectory(HILL, TICK), []
    find = trajectory._costate
    trajectory._costate = lambda *a: tried.append(a) or find(*a)
    for _ in range(70):  # an eighth of a revolution
        trajectory.begin(np.array([1e7, 0.0, 0.0, 0.0, 0.0, 0.0]), np.full(3, 1e-7), 0.0)
        assert trajectory.state is None
        trajectory.advance()
    assert len(tried) <= 8  # one bisection


def test_a_demand_beyond_the_model_starts_few_trajectories():
    """A constant push of ten times the limit, which no trajectory knows of: clipped, with a new start now and then."""
    trajectory, started = RecoveryTrajectory(HILL, TICK), 0
    phi, gamma = HILL.discretise(0.0, TICK)
    limit, error, ticks = np.full(3, 1e-5), np.zeros(6), round(HILL.period / TICK)
    for _ in range(ticks):
        demand, _ = trajectory.regulate(error, limit, 0.0, lambda off: -1e-4 * off[:3] - 1e-2 * off[3:])
        started += trajectory.has_begun
        error = phi @ error + gamma @ (np.clip(demand, -limit, limit) + 1e-4)
    assert 16 <= started <= STARTS + 1


def test_what_the_inputs_cannot_cancel_has_no_costate():
    rows = np.eye(2)
    np.testing.assert_allclose(least_effort(rows, np.array([0.5, -0.9]), 1.0, 1.0), [-0.5, 0.9], atol=1e-6)
    assert least_effort(rows, np.array([0.5, -1.1]), 1.0, 1.0) is None


def test_a_demand_is_overasked_by_the_axes_that_can_push():
    assert not is_overasked([2.0, -1.9, 5.0], [1.0, 1.0, 0.0])
    assert is_overasked([0.0, -2.1, 0.0], [1.0, 1.0, 0.0])


CHIEF = state_from_elements(LOW)


@pytest.mark.parametrize("algorithm", ["lqr", "sdre", "adaptive_lqr", "hinf"])
@pytest.mark.thorough
def test_every_regulator_recovers_from_half_a_kilometre(algorithm, estimate, target):
    """10 mN on 100 kg, default weights: 10 m ask for ten times the limit."""
    values = {"chief.semi_major_axis": 6978100.0, "tick": TICK, "algorithm": algorithm}
    manager = ControllerManager("controller", load(ControllerParameters, values))
    phi, gamma = HILL.discretise(0.0, TICK)
    state, spent = np.array([50.0, -500.0, 100.0, 0.0, 0.0, 0.0]), 0.0
    noise = np.random.default_rng(1).standard_normal((2400, 6)) * np.repeat([0.1, 1e-4], 3)
    for tick in range(2400):
        seen = estimate(state + noise[tick], TICK * tick, chief=CHIEF)
        thrust, _ = manager.on_tick(seen, target(time=TICK * tick))
        state = phi @ state + gamma @ thrust.force / 100.0
        spent += np.abs(thrust.force).sum() / 100.0 * TICK
    assert np.linalg.norm(state[:3]) < 1.0
    assert spent < 2.5  # the least is about 0.4; the rest answers the noise
