import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from formation_gnc.control.riccati import (
    RiccatiMap,
    Weights,
    continuous_gain,
    finite_gains,
    periodic_gains,
    stationary_gain,
)
from formation_gnc.errors import DesignError
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

HILL = HillModel(0.001083)
Q, R = np.diag([1.0, 1.0, 1.0, 1e4, 1e4, 1e4]), 1e8 * np.eye(3)


@pytest.mark.covers(
    "Neokleous (4.33)", "control/riccati.py", differs="the printed eigenvalues are those of R = I, not of 100 I"
)
def test_the_eigenvalues_are_those_printed_by_neokleous():
    # In minutes, sampled every 0.1 min. Printed for R = 100 I, they belong to R = I.
    phi, gamma = HillModel(7.2921e-5 * 60.0).discretise(0.0, 0.1)
    gain = stationary_gain(phi, gamma, Weights.scaled(np.eye(6), np.eye(3), 0.1))
    ours = np.sort_complex(np.linalg.eigvals(phi - gamma @ gain))[1::2]
    cut = np.floor(1e4 * np.column_stack([ours.real, ours.imag])) / 1e4  # printed digits are truncated
    np.testing.assert_allclose(cut, [[0.9156, 0.0462], [0.9159, 0.0458], [0.9161, 0.0454]], rtol=1e-12)


@settings(deadline=None)
@given(
    position=st.floats(-3.0, 3.0),
    velocity=st.floats(-5.0, 0.0),
    thrust=st.floats(-6.0, -3.0),
    tick=st.floats(0.0, 2.0),
)
@pytest.mark.covers("Neokleous (4.26)-(4.32)", "control/riccati.py")
def test_doubling_agrees_with_the_eigenvalue_method(position, velocity, thrust, tick):
    q = np.diag(np.repeat([10.0**-position, 10.0**-velocity], 3) ** 2)
    r = np.eye(3) * 10.0 ** (-2.0 * thrust)
    phi, gamma = HILL.discretise(0.0, 10.0**tick)
    weights = Weights.scaled(q, r, 10.0**tick)
    scaled_phi, scaled_gamma = weights.step(phi, gamma)
    theirs = solve_discrete_are(scaled_phi, scaled_gamma, weights.state, weights.input)
    ours = weights.map(phi, gamma).stabilising()
    # Near the unit circle both lose about half the digits, the eigenvalue method more.
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-6 * np.abs(theirs).max())


def test_the_cost_to_go_is_the_cost_of_the_closed_loop():
    phi, gamma = HILL.discretise(0.0, 30.0)
    weights = Weights.scaled(Q, R, 30.0)
    cost_to_go = weights.map(phi, gamma).stabilising()
    gain = stationary_gain(phi, gamma, weights)
    start = np.array([10.0, -5.0, 3.0, 0.01, 0.02, -0.01])
    state, paid = start, 0.0
    for _ in range(3000):
        thrust = -gain @ state
        paid += state @ Q @ state + thrust @ R @ thrust
        state = phi @ state + gamma @ thrust
    scaled = start / weights.state_unit
    assert paid == pytest.approx(weights.cost_unit * scaled @ cost_to_go @ scaled, rel=1e-9)


@pytest.mark.covers("Neokleous (4.21)-(4.25)", "control/riccati.py")
def test_repeated_steps_equal_the_step_by_step_recursion():
    phi, gamma = HILL.discretise(0.0, 20.0)
    one = Weights.scaled(Q, R, 20.0).map(phi, gamma)
    cost_to_go = np.eye(6)
    for _ in range(37):
        cost_to_go = one.backward(cost_to_go)
    np.testing.assert_allclose(one.repeated(37).backward(np.eye(6)), cost_to_go, rtol=1e-9, atol=1e-9)


@pytest.mark.covers("Roberts (38)-(40)", "control/riccati.py", "control/lqr.py")
def test_the_continuous_gain_is_the_limit_of_short_ticks():
    continuous = continuous_gain(HILL.dynamics(), HILL.INPUT, Weights.scaled(Q, R, 1.0))
    tick = 1e-3
    phi, gamma = HILL.discretise(0.0, tick)
    discrete = stationary_gain(phi, gamma, Weights.scaled(Q * tick, R * tick, tick))
    # First order in the tick over the time constant of 100 s.
    np.testing.assert_allclose(discrete, continuous, rtol=0.0, atol=1e-4 * np.abs(continuous).max())


@pytest.mark.covers("Neokleous (4.5)-(4.20)", "control/riccati.py")
def test_finite_gains_minimise_the_cost_over_all_thrust_histories():
    steps, tick = 12, 120.0
    phi, gamma = HILL.discretise(0.0, tick)
    terminal = 100.0 * Q
    gains = finite_gains(phi, gamma, Weights.scaled(Q, R, tick), terminal, steps)
    start = np.array([10.0, -5.0, 3.0, 0.01, 0.02, -0.01])
    # Reference: least squares over all 36 accelerations.
    free, forced = np.empty((steps, 6)), np.zeros((steps, 6, 3 * steps))
    state, response = start, np.zeros((6, 3 * steps))
    for step in range(steps):
        state, response = phi @ state, phi @ response
        response[:, 3 * step : 3 * step + 3] += gamma
        free[step], forced[step] = state, response
    roots = [np.sqrt(terminal if step == steps - 1 else Q) for step in range(steps)]
    rows = np.vstack(
        [root @ each for root, each in zip(roots, forced, strict=True)] + [np.sqrt(R[0, 0]) * np.eye(3 * steps)]
    )
    goal = np.concatenate([-root @ each for root, each in zip(roots, free, strict=True)] + [np.zeros(3 * steps)])
    scale = np.linalg.norm(rows, axis=0)
    thrusts = (np.linalg.lstsq(rows / scale, goal, rcond=None)[0] / scale).reshape(steps, 3)
    state = start
    for step in range(steps):
        thrust = -gains[step] @ state
        np.testing.assert_allclose(thrust, thrusts[step], rtol=1e-6, atol=1e-12)
        state = phi @ state + gamma @ thrust


@pytest.mark.thorough
def test_periodic_gains_equal_the_tick_by_tick_recursion():
    model = TschaunerHempelModel(KeplerChief(1.0e7, eccentricity=0.4))
    ticks, coarse = 2160, 180
    tick = model.period / ticks
    weights = Weights.scaled(1e-4 * Q, R, tick)  # a loop as slow as the orbit
    every = [model.discretise(index * tick, tick) for index in range(ticks)]
    cost_to_go = np.eye(6)
    truth = np.empty((ticks, 3, 6))
    for _ in range(4):
        for index in reversed(range(ticks)):
            truth[index] = weights.gain(*every[index], cost_to_go)
            cost_to_go = weights.map(*every[index]).backward(cost_to_go)
    repeats = ticks // coarse
    middles = [model.discretise((index + 0.5) * repeats * tick, tick) for index in range(coarse)]
    gains = periodic_gains(middles, repeats, weights)
    size = np.abs(truth).max(axis=0)
    # Intervals of 2 degrees: second order in their length, and half a tick of phase.
    assert (np.abs(gains - truth[repeats // 2 :: repeats]) / size.max(axis=1, keepdims=True)).max() < 5e-3
    assert (truth.max(axis=0) - truth.min(axis=0))[0, 0] > 0.5 * np.abs(truth[:, 0, 0]).min()  # the gains vary


@pytest.mark.parametrize(
    ("state", "thrust", "message"),
    [
        (np.diag([1.0, 1.0, -1.0, 1.0, 1.0, 1.0]), R, "state weight has a normalised eigenvalue of -1"),
        (Q, np.diag([1.0, 0.0, 1.0]), "thrust weight has a normalised eigenvalue of 0"),
        (np.zeros((6, 6)), R, "nothing to control"),
        (Q + np.eye(6, k=1), R, "not a symmetric matrix"),
        (np.nan * Q, R, "finite numbers"),
    ],
)
def test_inadmissible_weights_are_rejected_with_the_reason(state, thrust, message):
    with pytest.raises(DesignError, match=message):
        Weights.scaled(state, thrust, 1.0)


def test_an_unstabilisable_model_is_rejected():
    phi, gamma = HILL.discretise(0.0, 10.0)
    gamma[:, 2] = 0.0  # no cross-track thrust
    with pytest.raises(DesignError, match="stabilising solution"):
        stationary_gain(phi, gamma, Weights.scaled(Q, R, 10.0))


def test_the_map_of_no_steps_is_the_identity_of_composition():
    phi, gamma = HILL.discretise(0.0, 10.0)
    one = Weights.scaled(Q, R, 10.0).map(phi, gamma)
    identity = RiccatiMap(np.eye(6), np.zeros((6, 6)), np.zeros((6, 6)))
    np.testing.assert_allclose(one.then(identity).cost, one.cost, rtol=1e-14)
    np.testing.assert_allclose(identity.then(one).gramian, one.gramian, rtol=1e-14)
