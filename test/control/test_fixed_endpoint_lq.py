"""Fixed end-point LQ against least squares, the Hamiltonian transition matrix and nonlinear propagation."""

import numpy as np
import pytest
from numpy.linalg import LinAlgError
from scipy.linalg import block_diag, expm

from formation_gnc.control.fixed_endpoint_lq import (
    Cost,
    approximating_sequence,
    discretise,
    solve_fixed_endpoint,
    state_dependent,
)
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import INPUT
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

DURATION = 2000.0
START = np.array([353.0, 707.0, 353.0, 0.22, -0.44, 0.22])
GOAL = np.array([4960.0, -1270.0, 7430.0, -0.4, -6.2, -0.6])
CHIEF = Elements(1e7, 0.15, 1.0, 0.3, 0.2, 0.17)
NOTHING = np.zeros((6, 6))
UNIT = np.repeat([1.0, 1.0 / DURATION], 3)


def varying(steps):
    """Steps of Yamanaka and Ankersen's model, exactly discretised."""
    model, step = TschaunerHempelModel(KeplerChief.of(CHIEF)), DURATION / steps
    pairs = [model.discretise(k * step, step) for k in range(steps)]
    return tuple(np.array(each) for each in zip(*pairs, strict=True))


def stacked(phi, gamma):
    """Free motion (6 N, 6) and responses (6 N, 3 N) of the states after each step."""
    steps = len(phi)
    free, forced, x, f = [], [], np.eye(6), np.zeros((6, 3 * steps))
    for k in range(steps):
        x, f = phi[k] @ x, phi[k] @ f
        f[:, 3 * k : 3 * k + 3] += gamma[k]
        free.append(x)
        forced.append(f)
    return np.vstack(free), np.vstack(forced)


def test_without_a_state_weight_it_is_the_minimum_norm_solution():
    phi, gamma = varying(12)
    free, forced = stacked(phi, gamma)
    expected = np.linalg.lstsq(forced[-6:] / UNIT[:, None], (GOAL - free[-6:] @ START) / UNIT, rcond=None)[0]
    found = solve_fixed_endpoint(phi, gamma, START, GOAL, Cost(NOTHING, np.eye(3), NOTHING))
    np.testing.assert_allclose(found.inputs.ravel(), expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(found.states[-1] / UNIT, GOAL / UNIT, rtol=0, atol=1e-6)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.covers(
    "Owis (1.4); (1.5)",
    "control/fixed_endpoint_lq.py",
    differs="the condensed solution of the same problem in place of the Riccati equation integrated backwards",
)
@pytest.mark.covers("Neokleous (4.1)-(4.4)", "control/fixed_endpoint_lq.py")
def test_with_weights_it_satisfies_the_kkt_conditions(share):
    """KKT system in all inputs and multipliers at once; soft terminal constraint for share 1."""
    phi, gamma = varying(12)
    free, forced = stacked(phi, gamma)
    q, r = np.diag(UNIT**-2.0), np.diag([1e11, 2e11, 3e11])
    slack = share * np.diag((100.0 * UNIT) ** 2)
    # The cost has the state before each step: after steps 1 to N - 1, since the start is given.
    weight = block_diag(*[q] * 11, NOTHING)
    hessian = forced.T @ weight @ forced + block_diag(*[r] * 12)
    end = forced[-6:] / UNIT[:, None]
    left = np.block([[hessian, end.T], [end, -slack / np.outer(UNIT, UNIT)]])
    right = np.concatenate([-forced.T @ weight @ free @ START, (GOAL - free[-6:] @ START) / UNIT])
    expected = np.linalg.solve(left, right)[:36]
    found = solve_fixed_endpoint(phi, gamma, START, GOAL, Cost(q, r, slack))
    np.testing.assert_allclose(found.inputs.ravel(), expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    missed = np.linalg.norm((found.states[-1] - GOAL)[:3])
    assert missed < 1e-6 if share == 0.0 else missed > 1.0


@pytest.mark.covers("Owis (1.1)-(1.3)", "control/fixed_endpoint_lq.py")
def test_short_steps_converge_to_the_hamiltonian_transition_matrix():
    """Joshi (5.13)-(5.16), with the sign of (5.11) corrected and a weight on the state."""
    model, q, r = HillModel(6.3e-4), np.diag((1000.0 * UNIT) ** -2.0), 1e5
    dynamics = model.dynamics(0.0)
    unit = np.concatenate([UNIT, 1e-3 / UNIT])
    hamiltonian = np.block([[dynamics, -INPUT @ INPUT.T / r], [-q, -dynamics.T]])
    scaled = expm(hamiltonian * DURATION * np.outer(1.0 / unit, unit))
    start, goal = START / unit[:6], GOAL / unit[:6]
    costate = unit[6:] * np.linalg.solve(scaled[:6, 6:], goal - scaled[:6, :6] @ start)
    errors = []
    for n in (500, 1000):
        step = DURATION / n
        phi, gamma = (np.broadcast_to(each, (n, *each.shape)) for each in model.discretise(0.0, step))
        found = solve_fixed_endpoint(phi, gamma, START, GOAL, Cost(q * step, r * np.eye(3) * step, NOTHING))
        errors.append(np.linalg.norm(found.inputs[0] + costate[3:] / r))
    # The first input is the mean over the step: first order in its length.
    assert errors[0] < 0.02 * np.linalg.norm(costate[3:] / r)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)


def test_an_unreachable_goal_is_rejected():
    phi, gamma = varying(12)
    cost = Cost(NOTHING, np.eye(3), NOTHING)
    with pytest.raises(LinAlgError, match="singular"):
        solve_fixed_endpoint(phi[:1], gamma[:1], START, GOAL, cost)  # six states from three forces
    with pytest.raises(LinAlgError, match="not reachable"):
        solve_fixed_endpoint(
            phi, gamma[..., :2], START, GOAL, Cost(NOTHING, np.eye(2), NOTHING)
        )  # no cross-track thrust


@pytest.mark.parametrize("steps", [20, 40])
def test_discretisation_is_of_order_four(steps):
    model = TschaunerHempelModel(KeplerChief.of(CHIEF))
    errors = []
    for count in (steps, 2 * steps):
        half = np.linspace(0.0, DURATION, 2 * count + 1)
        a = np.array([model.dynamics(time) for time in half])
        phi, gamma = discretise(a, np.broadcast_to(INPUT, (len(a), 6, 3)), DURATION / count)
        exact = model.discretise(0.0, DURATION)
        whole, pushed = np.eye(6), np.zeros((6, 3))
        for k in range(count):
            whole, pushed = phi[k] @ whole, phi[k] @ pushed + gamma[k]
        errors.append(
            max(
                np.abs((whole - exact[0]) * UNIT / UNIT[:, None]).max(),
                np.abs((pushed - exact[1]) / UNIT[:, None]).max() / DURATION**2,
            )
        )
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.2)


MODELS = {
    "point masses": NonlinearModel(KeplerChief.of(CHIEF)),
    "with J2": OblateModel(OblateChief(CHIEF)),
}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("size", [0.0, 1.0, 20.0])
@pytest.mark.covers("Owis (2.1)-(2.6)", "control/fixed_endpoint_lq.py", "control/asre.py")
def test_a_converged_sequence_solves_the_nonlinear_equations(name, size):
    """Also from the chief itself, where a factorisation may divide by zero."""
    model, steps = MODELS[name], 40
    start, goal = size * START, max(size, 1.0) * GOAL
    guess = start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (goal - start)
    system = state_dependent(model, "sdc1", np.linspace(0.0, DURATION, 2 * steps + 1))
    found = approximating_sequence(
        system, guess, goal, DURATION, Cost(NOTHING, np.eye(3), NOTHING), 1e4 * UNIT, 1e-9, 20
    )
    assert found.converged
    assert len(found.changes) <= 6
    assert np.all(np.diff(found.changes) < 0.0)
    state, step = start, DURATION / steps
    for k, acceleration in enumerate(found.trajectory.inputs):
        state = model.propagate(k * step, state, step, acceleration)
    # RK4 at 50 s: 1e-7 of the distance.
    assert np.linalg.norm((state - goal)[:3]) < 2e-7 * np.linalg.norm(goal[:3])


def test_a_sequence_that_is_cut_short_has_not_converged():
    system = state_dependent(MODELS["with J2"], "sdc1", np.linspace(0.0, DURATION, 21))
    guess = START + np.linspace(0.0, 1.0, 11)[:, None] * (GOAL - START)
    found = approximating_sequence(system, guess, GOAL, DURATION, Cost(NOTHING, np.eye(3), NOTHING), UNIT, 1e-9, 2)
    assert not found.converged
    assert len(found.changes) == 2


def test_a_model_without_a_factorisation_is_rejected():
    with pytest.raises(ValueError, match="HillModel has no factorisation"):
        state_dependent(HillModel(1e-3), "sdc1", np.zeros(1))
