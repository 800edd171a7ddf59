"""Linear quadratic control with a fixed end point, and the sequence of such problems of ASRE.

The two-point boundary value problem of a linear system with quadratic cost has a Hamiltonian transition matrix
from state and costate at the start to those at the end (Joshi 5.13). Rearranged for the state at the end and
the costate at the start, it is the Riccati map of `formation_gnc.control.riccati`,

    x_N = A x_0 - G l_N,   l_0 = H x_0 + A' l_N,

whose blocks stay bounded as the horizon grows. The fixed end point requires the inverse of G, instead of the
block phi_12 of (5.16).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError

from formation_gnc.control.riccati import RiccatiMap
from formation_gnc.relative.model import INPUT, Array, RelativeModel
from formation_gnc.relative.nonlinear import FactorisedModel
from formation_gnc.types import Matrix, Vector

MIN_EIGENVALUE = 1e-10
"""Smallest eigenvalue of the Gramian, normalised to a unit diagonal, at which it counts as regular."""

System = Callable[[Array], tuple[Array, Array]]
"""A (2 N + 1, n, n) and B (2 N + 1, n, m) of dx/dt = A x + B u at states (2 N + 1, n): those at the beginnings,
middles and ends of N steps."""


def state_dependent(model: RelativeModel, factorisation: str, times: Vector) -> System:
    """The factorised equations of motion of a model, for states at times (M,), s.

    Raises:
        ValueError: the model has no factorisation.
    """
    if not isinstance(model, FactorisedModel):
        raise ValueError(f"{type(model).__name__} has no factorisation")
    along = model.chief.along(times)

    def system(states: Array) -> tuple[Array, Array]:
        matrices = model.factorised(states, along, factorisation)
        return matrices, np.broadcast_to(INPUT, (len(matrices), 6, 3))

    return system


def discretise(a: Array, b: Array, step: float) -> tuple[Array, Array]:
    """Phi (N, n, n) and Gamma (N, n, m) over N steps of held input, by RK4.

    Args:
        a: (2 N + 1, n, n) at the beginnings, middles and ends of the steps.
        b: (2 N + 1, n, m) likewise.
        step: length of a step, s.
    """
    size = a.shape[-1]
    joint = np.concatenate([a, b], axis=-1)
    begin, middle, end = joint[:-1:2], joint[1::2], joint[2::2]
    identity = np.broadcast_to(np.eye(size, joint.shape[-1]), begin.shape)
    forced = np.zeros_like(begin)

    def rate(matrix: Array, columns: Array) -> Array:
        forced[..., size:] = matrix[..., size:]
        change: Array = matrix[..., :size] @ columns + forced
        return change

    one = rate(begin, identity)
    two = rate(middle, identity + 0.5 * step * one)
    three = rate(middle, identity + 0.5 * step * two)
    four = rate(end, identity + step * three)
    result = identity + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return result[..., :size], result[..., size:]


@dataclass(frozen=True)
class Trajectory:
    """An optimal trajectory between two states."""

    inputs: Array
    """(N, m) held over the steps."""
    states: Array
    """(N + 1, n) at the ends of the steps."""


@dataclass(frozen=True)
class Cost:
    """Sum over the steps of x' Q x + u' R u, plus e' S^-1 e of the terminal error."""

    state: Matrix
    """(n, n) Q."""
    input: Matrix
    """(m, m) R."""
    slack: Matrix
    """(n, n) S; zero for a hard terminal constraint."""


def solve_fixed_endpoint(phi: Array, gamma: Array, start: Vector, goal: Vector, cost: Cost) -> Trajectory:
    """The optimal trajectory over the steps phi (N, n, n), gamma (N, n, m).

    Raises:
        LinAlgError: the Gramian is singular: not every state is reachable in these steps.
    """
    size = len(start)
    count = len(phi)
    maps = [RiccatiMap(np.eye(size), np.zeros((size, size)), np.zeros((size, size)))]
    own = [RiccatiMap.of_step(phi[k], gamma[k], cost.state, cost.input) for k in range(count)]
    for step in reversed(own):
        maps.append(step.then(maps[-1]))
    maps.reverse()  # each from the beginning of a step to the end of the horizon
    gramian = maps[0].gramian + cost.slack
    unit = np.sqrt(np.diag(gramian))
    if not (np.isfinite(unit).all() and unit.all()):
        raise LinAlgError("the transition block is singular: a state is not reachable")
    normal = gramian / np.outer(unit, unit)
    if (least := float(np.linalg.eigvalsh(normal)[0])) < MIN_EIGENVALUE:
        raise LinAlgError(f"the transition block is singular: its smallest eigenvalue is {least:.1e}")
    costate = np.linalg.solve(normal, (maps[0].transition @ start - goal) / unit) / unit
    states, inputs = np.empty((count + 1, size)), np.empty((count, gamma.shape[-1]))
    states[0] = start
    for k in range(count):
        later = maps[k + 1].transition.T @ costate
        free = phi[k] @ states[k] - own[k].gramian @ later
        states[k + 1] = np.linalg.solve(np.eye(size) + own[k].gramian @ maps[k + 1].cost, free)
        inputs[k] = -np.linalg.solve(cost.input, gamma[k].T @ (maps[k + 1].cost @ states[k + 1] + later))
    return Trajectory(inputs, states)


@dataclass(frozen=True)
class AsreResult:
    """Result of an approximating sequence."""

    trajectory: Trajectory
    """Solution of the last problem."""
    changes: tuple[float, ...]
    """Largest change of a state from each problem to the next, in the given units; the first from the guess."""
    converged: bool


def approximating_sequence(
    system: System,
    guess: Array,
    goal: Vector,
    duration: float,
    cost: Cost,
    unit: Vector,
    tolerance: float,
    max_iterations: int,
) -> AsreResult:
    """ASRE: linear problems, each with the matrices along the trajectory of the previous one (Owis 2.4-2.6).

    Args:
        system: factorised equations of motion.
        guess: (N + 1, n) states along which the first matrices are evaluated, from the start.
        goal: (n,) state at the end.
        duration: of the trajectory, s.
        cost: of a step.
        unit: (n,) unit of each state in the convergence test.
        tolerance: largest change of a state, in units, that counts as convergence.
        max_iterations: bound on the number of problems.

    Raises:
        LinAlgError: as :func:`solve_fixed_endpoint`, or the sequence diverges.
    """
    step = duration / (len(guess) - 1)
    states, changes = guess, list[float]()
    middles = 0.5 * (guess[:-1] + guess[1:])
    for _ in range(max_iterations):
        half = np.empty((2 * len(states) - 1, len(goal)))
        half[::2], half[1::2] = states, middles
        a, b = system(half)
        found = solve_fixed_endpoint(*discretise(a, b, step), guess[0], goal, cost)
        if not np.isfinite(found.states).all():
            raise LinAlgError("the sequence has diverged")
        # Middles of the steps by the cubic Hermite interpolant.
        pushed = (
            (b[::2][:-1] @ found.inputs[..., None])[..., 0],
            (b[::2][1:] @ found.inputs[..., None])[..., 0],
        )
        free = (a[::2] @ found.states[..., None])[..., 0]
        slope = free[:-1] + pushed[0] - free[1:] - pushed[1]
        middles = 0.5 * (found.states[:-1] + found.states[1:]) + step / 8.0 * slope
        changes.append(float(np.abs((found.states - states) / unit).max()))
        states = found.states
        if changes[-1] <= tolerance:
            break
    return AsreResult(found, tuple(changes), changes[-1] <= tolerance)
