"""Constraints of the MPC: each with its rows and bounds in the QP, and its limit on the commanded force.

The QP's variables are the forces of the plan over the force unit, (3 M,), then the slacks of each constraint.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from formation_gnc.control.condensed_qp import CondensedQp
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS, Matrix, Vector

LEFT = 1e-2
"""Force over the force unit that the solver's accuracy may leave when an eclipse begins; it is cut then."""


@dataclass(slots=True)
class PlanInputs:
    """Inputs of a plan."""

    qp: CondensedQp
    estimate: NavigationState
    target: Target
    previous: Matrix
    """(K, 3) forces of the plan in force, N; K is 0 if there is none."""


@dataclass(slots=True)
class Bounds:
    """Bounds of a constraint's rows for one plan."""

    lower: Vector
    upper: Vector
    coefficients: Vector | None = None
    """New non-zero elements of the rows' force columns, column by column; None if they are constant."""


class Constraint(ABC):
    """Linear constraint on the plan: lower <= A u + S s <= upper for forces u and own slacks s."""

    slacks: int = 0
    """Number of slack variables."""

    is_constant: bool = True
    """Whether the bounds are the same for every plan."""

    @abstractmethod
    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """A (R, 3 M) and S (R, slacks), each with its fixed sparsity."""

    @abstractmethod
    def bounds(self, inputs: PlanInputs) -> Bounds:
        """Bounds of the rows for one plan."""

    def slack_hessian(self) -> Vector:
        """(slacks,) quadratic cost of the slacks, in the scale of the QP."""
        return np.zeros(self.slacks)

    def slack_gradient(self, qp: CondensedQp) -> Vector:
        """(slacks,) linear cost of the slacks, in the scale of the QP."""
        return np.zeros(self.slacks)

    def clip(self, force: Vector, time: int, target: Target) -> Vector:
        """The force (3,), N, limited for the tick at a time (ns).

        The solution satisfies the constraint only to the solver's accuracy; an earlier plan or the fallback
        law may violate it altogether.
        """
        return force


class ThrustBox(Constraint):
    """Force limit per axis; with `off_in_eclipse` zero in every step and tick that meets a predicted eclipse.

    With a limit on the thrust rate, a step in which an eclipse begins is limited to what the ticks until then can
    take back: so it can be zero in time, whenever the plan is renewed. What the solver's accuracy has left above that
    is taken back as fast as possible.
    """

    def __init__(
        self, limit: Vector, steps: int, step: int, tick: int, off_in_eclipse: bool, rate: "ThrustRate | None" = None
    ) -> None:
        """Limit (3,) over the force unit; length of the plan's steps and of the tick in ns."""
        self._box = np.tile(limit, steps)
        self._steps, self._step, self._tick = steps, step, tick
        self._off_in_eclipse, self._rate = off_in_eclipse, rate
        self.is_constant = not off_in_eclipse

    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """The forces themselves."""
        count = len(self._box)
        return sparse.csc_array(sparse.eye_array(count)), sparse.csc_array((count, 0))

    def bounds(self, inputs: PlanInputs) -> Bounds:
        """The box, closed in the steps in eclipse."""
        box = self._box
        if self._off_in_eclipse:
            dark = meets(inputs.estimate.time, self._step, self._steps, inputs.target.eclipses)
            largest = np.full((self._steps, 3), np.inf)
            largest[dark] = 0.0 if self._rate is None else self._ramp(self._rate, inputs)[dark]
            box = np.minimum(box, largest.ravel())
        return Bounds(-box, box)

    def _ramp(self, rate: "ThrustRate", inputs: PlanInputs) -> Matrix:
        """(steps, 3) largest force from which the ticks until the next eclipse lead to zero."""
        steps, eclipses = np.arange(self._steps)[:, None], inputs.target.eclipses
        begin = inputs.estimate.time + self._step * steps
        ticks = np.where(eclipses[:, 1] > begin, (eclipses[:, 0] - begin) // self._tick, np.inf)
        ticks = ticks.min(axis=1, initial=np.inf)
        change = rate.change / rate.unit
        in_time = change * np.maximum(ticks, 0.0)[:, None]
        fastest = np.abs(rate.previous) / rate.unit - change * (1.0 + self._step // self._tick * steps)
        result: Matrix = np.clip(fastest, in_time, in_time + LEFT)
        return result

    def clip(self, force: Vector, time: int, target: Target) -> Vector:
        """Zero in eclipse."""
        if self._off_in_eclipse and meets(time, self._tick, 1, target.eclipses).any():
            return np.zeros(3)
        return force


class TotalThrust(Constraint):
    """Limit on the magnitude of the force: a polyhedron of 26 faces inside the sphere.

    The six faces normal to the axes are left to the thrust box, whose limit is at most `distance`.
    """

    def __init__(self, limit: float, unit: float, steps: int) -> None:
        """Limit and force unit in N."""
        self._limit, self._steps = limit, steps
        bound = np.full(10 * steps, limit / unit / circumradius())
        self.distance = float(bound[0])
        """Distance of the faces from the origin, over the force unit."""
        self._bounds = Bounds(-bound, bound)

    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """Projections on the face and space diagonals."""
        faces = sparse.csc_array(sparse.kron(sparse.eye_array(self._steps), sparse.csc_array(face_normals()[3:])))
        return faces, sparse.csc_array((faces.shape[0], 0))

    def bounds(self, inputs: PlanInputs) -> Bounds:
        """The distance of the faces."""
        return self._bounds

    def clip(self, force: Vector, time: int, target: Target) -> Vector:
        """Scaled down to the limit."""
        return force * min(1.0, self._limit / max(float(np.linalg.norm(force)), 1e-300))


class ThrustRate(Constraint):
    """Limit on the change of the force per axis, from step to step and from the force commanded before."""

    is_constant = False

    def __init__(self, rate: float, unit: float, steps: int, change_time: int, tick: int) -> None:
        """Rate in N/s and force unit in N; time available for a change between steps and length of the tick in ns."""
        self.change = rate * tick / NANOSECONDS
        """Largest change of the force from tick to tick, N."""
        self.unit, self._count = unit, 3 * steps
        self._scaled_change = np.full(3 * steps, rate * change_time / NANOSECONDS / unit)
        self._scaled_change[:3] = self.change / unit
        self.previous: Vector = np.zeros(3)
        """(3,) force commanded at the previous tick, N."""

    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """Differences between successive steps; the first step itself."""
        differences = sparse.eye_array(self._count) - sparse.eye_array(self._count, k=-3)
        return sparse.csc_array(differences), sparse.csc_array((self._count, 0))

    def bounds(self, inputs: PlanInputs) -> Bounds:
        """The largest changes, the first of them from the previous force."""
        middle = np.zeros(self._count)
        middle[:3] = self.previous / self.unit
        return Bounds(middle - self._scaled_change, middle + self._scaled_change)

    def clip(self, force: Vector, time: int, target: Target) -> Vector:
        """Within the largest change from the previous force."""
        return np.clip(force, self.previous - self.change, self.previous + self.change)


class ThrustMagnitude(Constraint):
    """Epigraph of the absolute cost: a slack above the magnitude of every force, with linear cost."""

    def __init__(self, steps: int) -> None:
        """One slack for each axis of each step."""
        self.slacks = 3 * steps
        zero, infinite = np.zeros(self.slacks), np.full(self.slacks, np.inf)
        self._bounds = Bounds(np.concatenate([-infinite, zero]), np.concatenate([zero, infinite]))

    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """u - s <= 0 and u + s >= 0."""
        eye = sparse.eye_array(self.slacks)
        return sparse.csc_array(sparse.vstack([eye, eye])), sparse.csc_array(sparse.vstack([-eye, eye]))

    def bounds(self, inputs: PlanInputs) -> Bounds:
        """One-sided."""
        return self._bounds

    def slack_gradient(self, qp: CondensedQp) -> Vector:
        """The price of thrust."""
        return qp.price


class KeepOutSpheres(Constraint):
    """Soft keep-out spheres about the neighbours, and optionally the chief, at the ends of the steps.

    Linearised at the plan in force: per step one half-space, tangent to the sphere of the satellite nearest
    then, at the point where the plan comes closest. The other satellites are assumed to move freely.
    """

    is_constant = False

    def __init__(
        self, radius: float, chief: bool, horizon: int, steps: int, unit: float, length: float, slack_weight: float
    ) -> None:
        """Radius and unit of length of the rows in m, force unit in N; the weight of the squared slacks is scaled."""
        self._radius, self._chief, self._length, self._unit = radius, chief, length, unit
        self._steps, self.slacks = steps, horizon
        self._weight = slack_weight
        self._pattern = np.repeat(np.tri(horizon, steps), 3, axis=1)
        column, row = np.nonzero(self._pattern.T)
        self._elements = row, column

    def rows(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """Distance by the forces of earlier steps; the coefficients are set for every plan."""
        return sparse.csc_array(2.0 * self._pattern), sparse.csc_array(sparse.eye_array(self.slacks))

    def slack_hessian(self) -> Vector:
        """Quadratic cost of a violation."""
        return np.full(self.slacks, self._weight)

    def bounds(self, inputs: PlanInputs) -> Bounds:
        """Half-spaces linearised at the plan in force; none without other satellites."""
        horizon = self.slacks
        upper = np.full(horizon, np.inf)
        others = np.vstack([inputs.target.neighbours, np.zeros((int(self._chief), 6))])
        if not len(others):
            return Bounds(-upper, upper, np.zeros(len(self._elements[0])))
        # Position relative to each other satellite: in free motion, and under the plan in force.
        free = (inputs.qp.free @ (inputs.estimate.relative_state - others).T).reshape(horizon, 6, -1)[:, :3]
        forced = inputs.qp.forced.reshape(horizon, 6, -1)[:, :3]
        planned = np.zeros((self._steps, 3))
        planned[: len(inputs.previous)] = inputs.previous / self._unit
        relative = free + (forced @ planned.ravel())[:, :, None]
        distance = np.linalg.norm(relative, axis=1)
        nearest = np.arange(horizon), slice(None), distance.argmin(axis=1)
        distance = distance.min(axis=1)[:, None]
        normal = np.where(distance > 1e-9, relative[nearest] / np.maximum(distance, 1e-9), [0.0, 1.0, 0.0])
        coefficients = (np.einsum("ki,kij->kj", normal, forced) / self._length)[self._elements]
        lower = (self._radius - np.einsum("ki,ki->k", normal, free[nearest])) / self._length
        return Bounds(lower, upper, coefficients)


def meets(time: int, step: int, steps: int, intervals: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(steps,) whether any part of each step (ns) from a time (ns) lies in any of intervals (N, 2), as of eclipses."""
    begin = time + step * np.arange(steps)[:, None]
    end = begin + step
    met: NDArray[np.bool_] = np.any((begin < intervals[:, 1]) & (end > intervals[:, 0]), axis=1)
    return met


@cache
def face_normals() -> Matrix:
    """(13, 3) axes, face diagonals and space diagonals: one of each opposite pair of 26 directions."""
    normals = [
        np.array([x, y, z]) / sqrt(x * x + y * y + z * z)
        for x in (1, 0, -1)
        for y in (1, 0, -1)
        for z in (1, 0, -1)
        if (x, y, z) > (0, 0, 0)
    ]
    return np.array(sorted(normals, key=lambda normal: np.count_nonzero(normal)))


@cache
def circumradius() -> float:
    """Distance of the farthest vertex of the polyhedron whose faces are at distance one."""
    normals = np.vstack([face_normals(), -face_normals()])
    farthest = 1.0
    for first in range(len(normals)):
        for second in range(first):
            for third in range(second):
                faces = normals[[first, second, third]]
                if abs(np.linalg.det(faces)) > 1e-9:
                    vertex = np.linalg.solve(faces, np.ones(3))
                    if (normals @ vertex <= 1.0 + 1e-9).all():
                        farthest = max(farthest, float(np.linalg.norm(vertex)))
    return farthest
