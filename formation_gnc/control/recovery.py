"""A trajectory to the target that keeps the thrust within its limit, from any error."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError

from formation_gnc.relative.model import INPUT, NO_THRUST, LinearModel
from formation_gnc.types import Matrix, Vector

SHARE = 0.8
"""Share of the thrust limit that a trajectory takes at most; the law corrects with the rest."""

STRETCH = 1.4
"""Duration over the shortest with that share: half the delta-v of the shortest transfer at full thrust."""

RATIO = 2.0**0.125
"""Ratio of successive durations that are tried."""

SHORTEST = 8
"""Ticks of the shortest trajectory."""

LONGEST = 100.0
"""Revolutions of the longest trajectory."""

NODES = 32
"""Nodes of the quadrature over a trajectory, and over each revolution of a circular orbit."""

COARSENESS = 6.0
"""Longest distance of nodes over the model's integration step."""

OVERASKED = 2.0
"""Demand over the limit beyond which a regulator is not clipped: it is stable with half its gain, not with less."""

RETRIES = 8
"""Trials per revolution for an error out of reach."""

STARTS = 64
"""Trajectories of a regulator per revolution, at most: more do nothing about what a model lacks."""

ITERATIONS = 30
"""Newton iterations for a costate beyond which a duration counts as too short; five to fifteen suffice."""

CLOSURE = 1e-6
"""Share of the error that may be left at the end, before discretisation."""

DAMPING = 1e-6
"""Least curvature of the dual cost, over the one without a thrust limit."""


def is_overasked(demand: Iterable[float], limit: Iterable[float]) -> bool:
    """Whether a demand is too far beyond a limit, by axis, for the clipped one to do."""
    for each, most in zip(demand, limit, strict=True):  # noqa: SIM110 - at every tick: a third of the time of any()
        if abs(each) > OVERASKED * most > 0.0:
            return True
    return False


@dataclass
class _Transfer:
    """A transfer under way."""

    time: float
    """Now, s, in the model's time."""
    left: float
    """Time to the end, s."""
    costate: Vector
    """(6,) now."""
    limit: Vector
    """(3,) of the acceleration, m/s^2."""


class RecoveryTrajectory:
    """The part of an error that the thrusters take back in their own time, and the acceleration that does so.

    The transfer to the target of least effort, the integral of the squared acceleration over its limit, with no axis
    beyond a share of the limit and in a multiple of the shortest time that this allows. There is one for every error,
    as free motion has no mode that grows exponentially.
    """

    def __init__(self, model: LinearModel, tick: float) -> None:
        """On a relative-motion model, with thrust held over a tick (s)."""
        self._model, self._tick = model, tick
        count = np.ceil(np.log(LONGEST * model.period / (SHORTEST * tick)) / np.log(RATIO))
        self._durations = SHORTEST * tick * RATIO ** np.arange(max(count, 1.0))
        self._spacing = min(model.period / NODES, COARSENESS * model.longest_step)
        self._step: tuple[Matrix, Matrix] | None = model.discretise(0.0, tick) if model.is_time_invariant else None
        self._transfer: _Transfer | None = None
        self._following: Vector = np.zeros(6)
        self._pause = 0
        """Ticks until an error out of reach is tried again."""
        self._kept = 0
        """Ticks until a regulator may start another trajectory."""
        self.planned: Vector = NO_THRUST
        """(3,) acceleration of the trajectory in the tick that was regulated last, m/s^2."""
        self.has_begun = False
        """Whether the trajectory started in that tick."""
        self.state: Vector | None = None
        """(6,) the trajectory now, relative to the target; None when there is none."""

    def regulate(
        self, error: Vector, limit: Vector, time: float, feedback: Callable[[Vector], Vector]
    ) -> tuple[Vector, Vector]:
        """A regulator's acceleration (3,) for this tick, about the trajectory, and the error (6,) from it.

        A trajectory starts where the regulator asks too much, unless one has just started.

        Args:
            error: (6,) state less target.
            limit: (3,) of the acceleration, m/s^2.
            time: of the model, s.
            feedback: acceleration (3,) for an error (6,).
        """
        self.has_begun = False
        self.planned = self.acceleration()
        if self.state is None:
            off, demand = error, feedback(error)
        else:
            off = error - self.state
            demand = feedback(off) + self.planned
        if self._kept == 0 and is_overasked(demand.tolist(), limit.tolist()):
            self.begin(error, limit, time)
            if self.state is not None:
                off, self.planned, self.has_begun = error - self.state, self.acceleration(), True
                demand = feedback(off) + self.planned
        self.advance()
        return demand, off

    def begin(self, error: Vector, limit: Vector, time: float) -> None:
        """Start at an error (6,), for a limit (3,), m/s^2, of the acceleration, at a time (s) of the model.

        Without cross-track thruster that motion is left out. No trajectory starts at an error out of reach, nor soon
        after one.
        """
        self._drop()
        self.planned = NO_THRUST
        controlled = np.tile([True, True, bool(limit[2] > 0.0)], 2)
        state = np.where(controlled, error, 0.0)
        if self._pause > 0 or not (np.isfinite(state).all() and limit[1] > 0.0):
            return
        low, high = 0, len(self._durations)
        while low < high:
            middle = (low + high) // 2
            is_enough = self._costate(state, limit, time, self._durations[middle], controlled) is not None
            low, high = (low, middle) if is_enough else (middle + 1, high)
        if low < len(self._durations):
            duration = STRETCH * float(self._durations[low])
            costate = self._costate(state, limit, time, duration, controlled)
            if costate is not None:
                self.state, self._transfer = state, _Transfer(time, duration, costate, limit)
                self._kept = round(self._model.period / STARTS / self._tick)
                return
        self._pause = round(self._model.period / RETRIES / self._tick)

    def _costate(self, state: Vector, limit: Vector, time: float, duration: float, controlled: Vector) -> Vector | None:
        """Costate (6,) at the start of the transfer in a duration (s); None if that is too short."""
        count = max(NODES, int(np.ceil(duration / self._spacing)))
        weight = duration / count
        nodes = np.asarray((np.arange(count) + 0.5) * weight, dtype=np.float64)
        inputs = np.broadcast_to(INPUT * limit, (count, 6, 3))
        effect = np.linalg.solve(self._model.transitions(time, nodes), inputs)[:, controlled]
        rows = effect.transpose(0, 2, 1).reshape(3 * count, -1)  # of the state at the start, by unit acceleration
        unit = np.sqrt(np.sum(rows**2, axis=0) * weight)
        found = least_effort(rows * weight / unit, state[controlled] / unit, SHARE, weight)
        if found is None:
            return None
        costate = np.zeros(6)
        costate[controlled] = found / unit
        return costate

    def end(self) -> None:
        """Drop the trajectory, as after ticks that were not regulated."""
        self._drop()
        self._pause = 0

    def _drop(self) -> None:
        self.state, self._transfer, self._kept = None, None, 0

    def acceleration(self) -> Vector:
        """(3,) acceleration for this tick, m/s^2; zero without a trajectory, and at its end."""
        transfer = self._transfer
        if transfer is None or self.state is None:
            return NO_THRUST
        if transfer.left < 0.5 * self._tick:
            self._drop()
            return NO_THRUST
        phi, gamma = self._step or self._middle_step(transfer.time)
        transfer.costate = np.asarray(np.linalg.solve(phi.T, transfer.costate), dtype=np.float64)
        demand = transfer.limit * (transfer.costate @ gamma) / self._tick
        acceleration: Vector = transfer.limit * np.clip(demand, -SHARE, SHARE)
        self._following = np.asarray(phi @ self.state + gamma @ acceleration, dtype=np.float64)
        return acceleration

    def _middle_step(self, time: float) -> tuple[Matrix, Matrix]:
        """Phi (6, 6), and Gamma (6, 3) of an impulse in the middle: exact to the square of the tick's angle."""
        half = 0.5 * self._tick
        later = self._model.transition(time + half, half)
        return later @ self._model.transition(time, half), self._tick * later @ INPUT

    def advance(self) -> None:
        """Move on by a tick under the last acceleration."""
        if self._pause > 0:
            self._pause -= 1
        if self._kept > 0:
            self._kept -= 1
        if self._transfer is not None and self.state is not None:
            self.state = self._following
            self._transfer.time += self._tick
            self._transfer.left -= self._tick


def least_effort(rows: Matrix, state: Vector, most: float, weight: float) -> Vector | None:
    """The costate l (n,) of the least sum of u^2 with rows' u = -state and |u| <= most: u = clip(rows l / weight).

    Newton's method on the dual cost, which is convex, with a line search.

    Args:
        rows: (N, n) effect of the inputs on the state.
        state: (n,) to cancel.
        most: largest input.
        weight: of the inputs in the sum.

    Returns:
        None if the inputs do not suffice.
    """

    def cost(costate: Vector) -> float:
        wanted = np.abs(rows @ costate) / weight
        inner = np.minimum(wanted, most)
        return float(weight * np.sum(inner * (wanted - 0.5 * inner)) + costate @ state)

    costate, damping = np.zeros(len(state)), DAMPING * np.diag(np.sum(rows**2, axis=0)) / weight
    value, size = 0.0, CLOSURE * float(np.abs(state).max())
    for _ in range(ITERATIONS):
        wanted = rows @ costate / weight
        slope = rows.T @ np.clip(wanted, -most, most) + state
        if np.abs(slope).max() <= size:
            return costate
        free = rows[np.abs(wanted) < most]
        try:
            step = -np.linalg.solve(free.T @ free / weight + damping, slope)
        except LinAlgError:
            return None
        share, decrease = 1.0, 1e-4 * float(slope @ step)
        while (new := cost(costate + share * step)) > value + share * decrease:
            share *= 0.5
            if share < CLOSURE:
                return None
        costate, value = costate + share * step, new
    return None
