"""From one state to another in a given time: the linear problem, and the sequence of them that ASRE is.

The two-point problem of a linear system and a quadratic cost has a Hamiltonian transition matrix, which takes
state and co-state from the start to the end (Joshi 5.13). Solved for the state at the end and the co-state at
the start, it is the Riccati map of `formation_gnc.control.riccati`,

    x_N = A x_0 - G l_N,   l_0 = H x_0 + A' l_N:

the same four blocks, of which none grows with the horizon. G is what has to be inverted for a given end, in
the place of the block phi_12 of (5.16).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError

from formation_gnc.control.riccati import RiccatiMap
from formation_gnc.relative.chief import Chief
from formation_gnc.relative.factorisation import oblateness, sdc1, sdc2
from formation_gnc.relative.model import INPUT, Array, RelativeModel
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.types import Matrix, Vector

FACTORISATIONS = {"sdc1": sdc1, "sdc2": sdc2}
"""Joshi's methods I and II, by name."""

SINGULAR = 1e-10
"""Smallest eigenvalue of the reach, each state in units of its own reach, that can be inverted."""

System = Callable[[Array], tuple[Array, Array]]
"""Matrices A (2 N + 1, n, n) and B (2 N + 1, n, m) of dx/dt = A x + B u at states (2 N + 1, n), which are
those at the beginnings, middles and ends of N steps."""


def state_dependent(model: RelativeModel, factorisation: str, times: Vector) -> System:
    """The equations of relative motion as a system, for states at times (M,), s: with J2 if the model has it.

    Raises:
        ValueError: a model that is not one of these equations.
    """
    if not isinstance(model, NonlinearModel | OblateModel):
        raise ValueError(f"{type(model).__name__} has no factorisation")
    chief: Chief = model.chief
    along = chief.along(times)
    oblate = isinstance(model, OblateModel)

    def system(states: Array) -> tuple[Array, Array]:
        matrices: Array = FACTORISATIONS[factorisation](states, along)
        if oblate:
            matrices[..., 3:, :3] += oblateness(states, along)
        return matrices, np.broadcast_to(INPUT, (len(matrices), 6, 3))

    return system


def discretised(a: Array, b: Array, step: float) -> tuple[Array, Array]:
    """Phi (N, n, n) and Gamma (N, n, m) over N steps of held input, to order four.

    Args:
        a: (2 N + 1, n, n) at the beginnings, middles and ends of the steps.
        b: (2 N + 1, n, m) likewise.
        step: length of each, s.
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
class Steering:
    """What takes a system from one state to another."""

    inputs: Array
    """(N, m) held over the steps."""
    states: Array
    """(N + 1, n)."""


@dataclass(frozen=True)
class Cost:
    """Sum over the steps of x' Q x + u' R u, plus e' S^-1 e of the error at the end."""

    state: Matrix
    """(n, n) Q."""
    input: Matrix
    """(m, m) R."""
    slack: Matrix
    """(n, n) S; zero for no error at the end."""


def steer(phi: Array, gamma: Array, start: Vector, goal: Vector, cost: Cost) -> Steering:
    """The least costly way over the steps phi (N, n, n), gamma (N, n, m).

    Raises:
        LinAlgError: the block to be inverted is singular: the input cannot reach every state in these steps.
    """
    size = len(start)
    count = len(phi)
    maps = [RiccatiMap(np.eye(size), np.zeros((size, size)), np.zeros((size, size)))]
    own = [RiccatiMap.of_step(phi[k], gamma[k], cost.state, cost.input) for k in range(count)]
    for step in reversed(own):
        maps.append(step.then(maps[-1]))
    maps.reverse()  # from the beginning of each step to the end of all
    reach = maps[0].reach + cost.slack
    unit = np.sqrt(np.diag(reach))
    if not (np.isfinite(unit).all() and unit.all()):
        raise LinAlgError("the transition block is singular: a state is out of the input's reach")
    normal = reach / np.outer(unit, unit)
    if (least := float(np.linalg.eigvalsh(normal)[0])) < SINGULAR:
        raise LinAlgError(f"the transition block is singular: its smallest eigenvalue is {least:.1e}")
    costate = np.linalg.solve(normal, (maps[0].transition @ start - goal) / unit) / unit
    states, inputs = np.empty((count + 1, size)), np.empty((count, gamma.shape[-1]))
    states[0] = start
    for k in range(count):
        later = maps[k + 1].transition.T @ costate
        free = phi[k] @ states[k] - own[k].reach @ later
        states[k + 1] = np.linalg.solve(np.eye(size) + own[k].reach @ maps[k + 1].cost, free)
        inputs[k] = -np.linalg.solve(cost.input, gamma[k].T @ (maps[k + 1].cost @ states[k + 1] + later))
    return Steering(inputs, states)


@dataclass(frozen=True)
class Sequence:
    """How a sequence of linear problems went."""

    steering: Steering
    """The last of them."""
    changes: tuple[float, ...]
    """How far the states moved from each to the next, in the unit given; the first from the guess."""
    converged: bool


def approximating_sequence(
    system: System,
    guess: Array,
    goal: Vector,
    duration: float,
    cost: Cost,
    unit: Vector,
    tolerance: float,
    most_iterations: int,
) -> Sequence:
    """ASRE: linear problems, each with the system's matrices along the way of the one before (Owis 2.4-2.6).

    Args:
        system: the factorised equations of motion.
        guess: (N + 1, n) states along which the first matrices are taken; the first of them is the start.
        goal: (n,) state to have at the end.
        duration: time for it, s.
        cost: of a step.
        unit: (n,) size of each state, by which a change is judged.
        tolerance: largest change, in units, at which the sequence has converged.
        most_iterations: problems after which it has not.

    Raises:
        LinAlgError: as :func:`steer`, or states that are not finite.
    """
    step = duration / (len(guess) - 1)
    states, changes = guess, list[float]()
    middles = 0.5 * (guess[:-1] + guess[1:])
    for _ in range(most_iterations):
        half = np.empty((2 * len(states) - 1, len(goal)))
        half[::2], half[1::2] = states, middles
        a, b = system(half)
        found = steer(*discretised(a, b, step), guess[0], goal, cost)
        if not np.isfinite(found.states).all():
            raise LinAlgError("the sequence has left all bounds")
        # cubic through both ends, with the rates that the linear problem has there
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
    return Sequence(found, tuple(changes), changes[-1] <= tolerance)
