import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.control.plan import Task
from formation_gnc.control.static_programming import advance, gmpsp, mpsp
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel

CHIEF = KeplerChief(1e7, 0.15, 1.0, 0.3, 0.2)
TOLERANCE = np.repeat([1e-3, 1e-6], 3)
START = np.array([350.0, 700.0, 350.0, 0.2, -0.4, 0.2])
GOAL = np.array([3000.0, -8000.0, 4500.0, -2.5, -3.8, -3.8])


def task(steps, **changes):
    return dataclasses.replace(Task(NonlinearModel(CHIEF), 0.0, START, GOAL, 2000.0, steps), **changes)


def effort(plan):
    """Integral of the squared acceleration, by the quadrature of the method."""
    squares = (plan.history**2).sum(axis=1)
    if len(plan.history) == len(plan.acceleration):
        return squares.sum() * plan.duration / len(squares)
    steps = len(squares) // 2
    return plan.duration / steps / 6.0 * (squares[:-1:2] + 4.0 * squares[1::2] + squares[2::2]).sum()


@pytest.mark.parametrize("method", [mpsp, gmpsp])
@pytest.mark.parametrize("model", [NonlinearModel(CHIEF), OblateModel(CHIEF)], ids=["point mass", "J2"])
def test_the_plan_reaches_the_goal_under_another_integrator(method, model):
    plan = method(task(100, model=model), TOLERANCE)
    assert not plan.failure
    assert plan.iterations == 2  # quadratic convergence: 10 km, metres, nanometres
    state, step = START, plan.duration / len(plan.acceleration)
    for k, acceleration in enumerate(plan.acceleration):
        state = model.propagate(k * step, state, step, acceleration)
    # MPSP: RK4 at 20 s. G-MPSP: a smooth history held over half steps, step^2 / 12 times the change of the
    # acceleration per axis.
    bound = 1e-3 if method is mpsp else step**2 / 6.0 * np.ptp(plan.history, axis=0).max()
    assert (np.abs(state - GOAL) < np.repeat([bound, 2e-3 * bound], 3)).all()


def test_one_iteration_on_a_linear_model_is_the_minimum_energy_plan():
    """Closed form: u = B' Phi(tf, t)' G^-1 (x_f - Phi x_0), with G the controllability Gramian."""
    model = HillModel(1e-3)
    plan = mpsp(task(400, model=model), TOLERANCE)
    assert plan.iterations == 1
    step = 5.0
    phi, gamma = model.discretise(0.0, step)
    maps = [np.linalg.matrix_power(phi, 399 - k) @ gamma for k in range(400)]
    gramian = sum(each @ each.T for each in maps)
    missing = GOAL - model.transition(0.0, 2000.0) @ START
    least = np.array([each.T @ np.linalg.solve(gramian, missing) for each in maps])
    np.testing.assert_allclose(plan.acceleration, least, rtol=0.0, atol=1e-9 * np.abs(least).max())


@pytest.mark.parametrize("order", [("euler", 1), ("rk4", 4)])
def test_the_integration_step_has_its_order_and_exact_sensitivities(order):
    method, expected = order
    model, thrust = OblateModel(CHIEF), np.array([1e-3, -2e-3, 1e-3])
    exact = model.propagate(0.0, GOAL, 40.0, thrust)

    def miss(steps):
        state = GOAL
        for k in range(steps):
            state = advance(model, k * 40.0 / steps, state, thrust, 40.0 / steps, method)[0]
        return np.linalg.norm(state - exact)

    assert np.log2(miss(2) / miss(4)) == pytest.approx(expected, abs=0.3)
    slopes = advance(model, 0.0, GOAL, thrust, 40.0, method)[1]
    size = np.array([10.0] * 3 + [1e-2] * 3 + [1e-4] * 3)
    for column, amount in enumerate(np.diag(size)):
        ends = [
            advance(model, 0.0, GOAL + sign * amount[:6], thrust + sign * amount[6:], 40.0, method)[0]
            for sign in (1.0, -1.0)
        ]
        slope = (ends[0] - ends[1]) / (2.0 * size[column])
        np.testing.assert_allclose(slopes[:, column], slope, rtol=0.0, atol=1e-6 * np.abs(slope).max())


@pytest.mark.covers("Joshi (7.1)-(7.23)", "control/static_programming.py", "control/gmpsp.py")
def test_both_methods_converge_to_one_optimum_as_steps_shrink():
    """The excess cost of held thrust is of second order in the step."""
    continuous = effort(gmpsp(task(200), TOLERANCE))
    excess = [effort(mpsp(task(steps), TOLERANCE)) / continuous - 1.0 for steps in (25, 50)]
    assert 0.0 < excess[1] < excess[0] < 2e-3
    assert excess[0] / excess[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.covers("Joshi (6.1)-(6.11)", "control/static_programming.py", "control/mpsp.py")
def test_a_converged_history_is_stationary():
    """First-order optimality: no component in the null space of the sensitivities."""
    plan = mpsp(task(50), TOLERANCE)
    state, slopes = START, []
    for k in range(50):
        state, slope = advance(task(50).model, 40.0 * k, state, plan.acceleration[k], 40.0, "rk4")
        slopes.append(slope)
    onward, rows = np.eye(6), []
    for slope in reversed(slopes):
        rows.insert(0, onward @ slope[:, 6:])
        onward = onward @ slope[:, :6]
    sensitivity = np.hstack(rows)
    flat = plan.acceleration.ravel()
    within = flat - sensitivity.T @ np.linalg.lstsq(sensitivity.T, flat, rcond=None)[0]
    assert np.linalg.norm(within) < 1e-8 * np.linalg.norm(flat)  # the history lies in the range of B'


def test_an_axis_without_thrust_is_replaced_by_the_others():
    plan = mpsp(task(50, effort=np.diag([np.inf, 1.0, 1.0])), TOLERANCE)
    assert not plan.failure
    assert not plan.acceleration[:, 0].any()
    assert effort(plan) > effort(mpsp(task(50), TOLERANCE))


@pytest.mark.parametrize("method", [mpsp, gmpsp])
def test_slack_trades_the_terminal_error_against_effort(method):
    hard, slack = method(task(50), TOLERANCE), np.repeat([1e6, 1.0], 3)
    soft = method(task(50, slack=np.diag(slack)), TOLERANCE)
    assert not soft.failure

    def cost(plan):
        return effort(plan) + np.sum(plan.errors[-1] ** 2 / slack)

    assert np.linalg.norm(soft.errors[-1][:3]) > 1.0
    assert cost(soft) < cost(hard)
    softer = method(task(50, slack=1.01 * np.diag(slack)), TOLERANCE)  # a perturbed solution under the same cost
    assert cost(soft) < cost(softer)


@pytest.mark.parametrize(
    ("changes", "steps", "reason"),
    [
        ({"effort": np.diag([1.0, 1.0, np.inf])}, 50, "singular"),  # no cross-track thrust
        ({"duration": 0.0}, 50, "past by 0 s"),
        ({"duration": -20.0}, 50, "past by 20 s"),
        ({"state": np.array([np.nan, 0, 0, 0, 0, 0])}, 50, "not finite"),
        ({"goal": np.array([1e300, 0, 0, 0, 0, 0])}, 50, "iteration 1 is not finite"),
        ({"guess": np.full((50, 3), 1e200)}, 50, "iteration 0 is not finite"),
    ],
)
@pytest.mark.parametrize("method", [mpsp, gmpsp])
def test_an_infeasible_task_is_reported(method, changes, steps, reason):
    plan = method(task(steps, **changes), TOLERANCE)
    assert reason in plan.failure


def test_one_step_cannot_meet_six_terminal_conditions():
    assert "singular" in mpsp(task(1), TOLERANCE).failure
    assert not mpsp(task(2), TOLERANCE).failure


@pytest.mark.parametrize("method", [mpsp, gmpsp])
def test_the_number_of_iterations_is_bounded(method):
    assert "1 iterations leave" in method(task(50), TOLERANCE, 1).failure
    assert "5 iterations leave" in method(task(50), np.zeros(6), 5).failure


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6),
    st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6),
    st.floats(-10.0, 1e5),
    st.integers(1, 20),
    st.sampled_from([mpsp, gmpsp]),
)
def test_a_plan_reaches_the_goal_or_reports_a_failure(state, goal, duration, steps, method):
    scale = np.repeat([1.0, 1e-3], 3)
    problem = task(steps, state=np.array(state) * scale, goal=np.array(goal) * scale, duration=duration)
    plan = method(problem, TOLERANCE)
    if not plan.failure:
        assert np.isfinite(plan.acceleration).all()
        assert (np.abs(plan.errors[-1]) <= TOLERANCE).all()


def place(state):
    return state[:3], np.eye(3, 6)


def distance(state):
    size = np.linalg.norm(state[:3])
    return np.array([size]), np.concatenate([state[:3] / size, np.zeros(3)])[None]


@pytest.mark.covers(
    "Joshi (6.1)-(6.11); (7.1)-(7.23); MPSP, fewer outputs than states; G-MPSP, fewer outputs than states",
    "control/static_programming.py",
)
@pytest.mark.parametrize("method", [mpsp, gmpsp])
@pytest.mark.parametrize(("output", "unit"), [(place, 1e-3), (distance, 1e-3)])
def test_outputs_fewer_than_states_are_reached_at_less_effort(method, output, unit):
    """What is not asked for is free: each output more can only cost more."""
    plan = method(task(100), np.full(len(output(GOAL)[0]), unit), output=output)
    assert not plan.failure
    assert plan.errors.shape[1] == len(output(GOAL)[0])
    assert (np.abs(plan.errors[-1]) <= unit).all()
    others = [method(task(100), TOLERANCE)]
    if output is distance:
        others.append(method(task(100), np.full(3, unit), output=place))
    for other in others:
        assert effort(plan) < effort(other)


def test_outputs_on_a_linear_model_are_the_minimum_norm_plan():
    """Closed form for the place alone: u = B' C' (C G C')^-1 C (x_f - Phi x_0)."""
    model = HillModel(1e-3)
    plan = mpsp(task(200, model=model), np.full(3, 1e-3), output=place)
    phi, gamma = model.discretise(0.0, 10.0)
    maps = [(np.linalg.matrix_power(phi, 199 - k) @ gamma)[:3] for k in range(200)]
    gramian = sum(each @ each.T for each in maps)
    missing = (GOAL - model.transition(0.0, 2000.0) @ START)[:3]
    least = np.array([each.T @ np.linalg.solve(gramian, missing) for each in maps])
    assert plan.iterations == 1
    np.testing.assert_allclose(plan.acceleration, least, rtol=0.0, atol=1e-9 * np.abs(least).max())
