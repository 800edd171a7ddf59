"""Propagation: order of convergence, conservation, independent integration, the transition matrix."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_acceleration
from formation_gnc.orbit.gravity import acceleration, gradient
from formation_gnc.orbit.propagation import Propagator, propagate_with_transition

LEO = Elements(6978.1e3, 0.001, np.radians(85.0), 0.3, 0.2, 0.1)
ECCENTRIC = Elements(2e7, 0.6, np.radians(50.0), 0.3, 0.2, 0.1)


def propagated(elements, ticks, tick, thrust=(0.0, 0.0, 0.0)):
    propagator, states = Propagator(tick), state_from_elements(elements)[None]
    for k in range(ticks):
        states = propagator.propagate(k * tick, states, np.array([thrust]))
    return states[0]


def reference(elements, duration, thrust=(0.0, 0.0, 0.0)):
    """The same physics, independently written, by SciPy's adaptive method."""

    def potential_gradient(position):
        x, y, z = position
        r = np.sqrt(x * x + y * y + z * z)
        factor = 1.5 * J2 * MU * EARTH_RADIUS**2 / r**5
        oblate = factor * np.array([x * (5 * z**2 / r**2 - 1), y * (5 * z**2 / r**2 - 1), z * (5 * z**2 / r**2 - 3)])
        return -MU * position / r**3 + oblate

    def derivative(_, state):
        return np.concatenate((state[3:], potential_gradient(state[:3]) + thrust))

    solution = solve_ivp(
        derivative, (0.0, duration), state_from_elements(elements), method="DOP853", rtol=1e-13, atol=1e-9
    )
    return solution.y[:, -1]


def test_leo_orbit_at_one_second_ticks_is_accurate_to_10_micrometres():
    duration = 5801
    # Both methods are limited by rounding here: 1e-9 m a step.
    assert np.linalg.norm((propagated(LEO, duration, 1.0) - reference(LEO, duration))[:3]) < 1e-5


def test_held_thrust_agrees_with_independent_integration():
    thrust = (1e-4, -2e-4, 3e-4)
    assert np.linalg.norm((propagated(LEO, 600, 10.0, thrust) - reference(LEO, 6000.0, thrust))[:3]) < 1e-5


@pytest.mark.parametrize(("elements", "coarse"), [(LEO, 50), (ECCENTRIC, 150)])
def test_the_method_is_of_order_eight(elements, coarse):
    duration = elements.period
    truth = reference(elements, duration)
    ends = [propagated(elements, count, duration / count) for count in (coarse, 2 * coarse)]
    error = [np.linalg.norm((end - truth)[:3]) for end in ends]
    assert error[1] > 1e-6  # above rounding, so that the ratio is significant
    assert 7.5 < np.log2(error[0] / error[1]) < 9.5


def test_substeps_equal_shorter_ticks():
    state = state_from_elements(ECCENTRIC)[None]
    whole = Propagator(60.0, substeps=6).propagate(0.0, state, np.zeros((1, 3)))
    assert whole[0] == pytest.approx(propagated(ECCENTRIC, 6, 10.0), abs=0.0)


def test_energy_and_axial_momentum_are_conserved():
    start, end = state_from_elements(ECCENTRIC), propagated(ECCENTRIC, 4000, 10.0)

    def energy(state):
        r = np.linalg.norm(state[:3])
        latitude = (3 * (state[2] / r) ** 2 - 1) / 2
        return state[3:] @ state[3:] / 2 - MU / r * (1 - J2 * (EARTH_RADIUS / r) ** 2 * latitude)

    def axial(state):
        return state[0] * state[4] - state[1] * state[3]

    # Random-walk rounding over 4,000 steps.
    assert energy(end) == pytest.approx(energy(start), rel=1e-13)
    assert axial(end) == pytest.approx(axial(start), rel=1e-13)


def test_satellites_are_independent():
    together = np.array([state_from_elements(LEO), state_from_elements(ECCENTRIC)])
    thrust = np.array([[0.0, 1e-4, 0.0], [1e-4, 0.0, 0.0]])
    propagator = Propagator(30.0)
    both = propagator.propagate(0.0, together, thrust)
    for k in range(2):
        alone = propagator.propagate(0.0, together[k : k + 1], thrust[k : k + 1])
        assert np.array_equal(alone[0], both[k])


def test_hill_frame_forces_equal_the_same_inertial_accelerations():
    states = np.array([state_from_elements(LEO), state_from_elements(ECCENTRIC)])
    forces, masses = np.array([[0.0, 0.0, 0.0], [0.01, -0.02, 0.03]]), np.array([100.0, 7.0])
    propagator, before = Propagator(30.0), states.copy()
    accelerations = inertial_acceleration(states[0], forces, masses)
    moved = propagator.propagate_with_thrust(0.0, states, forces, masses)
    assert np.array_equal(moved, propagator.propagate(0.0, states, accelerations, masses))
    assert np.array_equal(states, before)


def test_propagation_is_pure_and_reproducible_to_the_bit():
    states = state_from_elements(LEO)[None]
    before = states.copy()
    propagator = Propagator(1.0)
    first = propagator.propagate(0.0, states, np.zeros((1, 3)))
    assert np.array_equal(states, before)
    assert np.array_equal(first, propagator.propagate(0.0, states, np.zeros((1, 3))))


def test_gradient_is_the_derivative_of_acceleration():
    position = state_from_elements(LEO)[:3]
    step = 10.0
    numeric = np.array(
        [(acceleration(position + step * e) - acceleration(position - step * e)) / (2 * step) for e in np.eye(3)]
    ).T
    # Rounding of the 8 m/s^2, 1e-15, over twice the step; truncation is 1e-18.
    assert gradient(position) == pytest.approx(numeric, rel=1e-8, abs=3e-16)
    assert abs(np.trace(gradient(position))) < 1e-20


def test_transition_is_symplectic_and_the_derivative_of_the_state():
    state, thrust = state_from_elements(LEO), np.array([1e-4, 0.0, -1e-4])
    end, transition = propagate_with_transition(state, thrust, 60.0, 4)
    assert end == pytest.approx(Propagator(60.0, substeps=4).propagate(0.0, state[None], thrust[None])[0], abs=0.0)
    for column, step in enumerate([1.0] * 3 + [1e-3] * 3):
        change = step * np.eye(6)[column]
        ahead, _ = propagate_with_transition(state + change, thrust, 60.0, 4)
        behind, _ = propagate_with_transition(state - change, thrust, 60.0, 4)
        # Rounding of positions, 1e-9 m, and velocities, 1e-12 m/s, over the step.
        tolerance = np.array([1e-9] * 3 + [1e-12] * 3) * 4 / step
        assert np.all(np.abs((ahead - behind) / (2 * step) - transition[:, column]) < tolerance)
    swap = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]])
    assert transition.T @ swap @ transition == pytest.approx(swap, abs=1e-13)


@pytest.mark.parametrize("tick", [0.0, -1.0, float("nan"), float("inf")])
def test_tick_must_be_finite_and_positive(tick):
    with pytest.raises(ConfigurationError, match="tick is"):
        Propagator(tick)


def test_substeps_must_be_positive():
    with pytest.raises(ConfigurationError, match="substeps is 0"):
        Propagator(1.0, substeps=0)
