"""A primal-dual interior-point method for the QP of one plan: Mehrotra's predictor and corrector."""

from collections.abc import Callable

import numpy as np
from numpy.linalg import LinAlgError
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve

from formation_gnc.control.quadratic_programme import QuadraticProgramme
from formation_gnc.types import Vector

MAX_ITERATIONS = 60
"""Iterations without convergence that count as failure; five to twenty suffice."""

TOLERANCE = 1e-5
"""Complementarity, over the cost, at which the iteration ends."""

FEASIBLE = 1e-7
"""Largest violation of a bound, with forces over the force unit; and half the narrowest distance of two bounds,
since the method needs an interior."""

TO_BOUNDARY = 0.995
"""Share of the step to the boundary that is taken."""

Direction = tuple[Vector, Vector, Vector]
"""Changes of the point, of the distances to the bounds and of the multipliers."""


def interior_point(programme: QuadraticProgramme) -> tuple[Vector, Vector, int]:
    """The solution (F + S,), its multipliers (R,), positive at upper bounds, and the number of iterations.

    Each iteration solves Newton's equations of the optimality conditions, G x + t = h with the finite bounds as
    rows of G, by a Cholesky factorisation in the forces alone: a row has one slack at most, so that the block of
    the slacks is diagonal. Converges at any scale of the cost, also for a linear one.

    Raises:
        LinAlgError: no convergence, as without a feasible point.
    """
    bounds = _Bounds(programme)
    rows, limit = bounds.rows, bounds.limit
    point, distance = np.zeros(rows.shape[1]), np.maximum(limit, 1.0)
    multiplier = np.full(len(limit), max(1.0, float(np.abs(programme.linear).max())))
    for iteration in range(MAX_ITERATIONS):
        slope = programme.curve(point) + programme.linear + rows.T @ multiplier
        missing = rows @ point + distance - limit
        gap = float(distance @ multiplier)
        allowed = TOLERANCE * abs(programme.cost(point)) + np.finfo(float).eps
        if gap <= allowed and np.abs(missing).max() <= FEASIBLE and np.abs(slope).sum() <= allowed:
            return point, bounds.multipliers(multiplier), iteration
        solve = _newton(programme, rows, slope, missing, distance, multiplier)
        _, far, more = solve(distance * multiplier)
        reached = distance + _longest(distance, far) * far, multiplier + _longest(multiplier, more) * more
        centre = (float(reached[0] @ reached[1]) / gap) ** 3 * gap / len(limit)
        move, far, more = solve(distance * multiplier + far * more - centre)
        share = min(1.0, TO_BOUNDARY * min(_longest(distance, far, np.inf), _longest(multiplier, more, np.inf)))
        point, distance, multiplier = point + share * move, distance + share * far, multiplier + share * more
    raise LinAlgError(f"no solution in {MAX_ITERATIONS} iterations of the interior-point method")


class _Bounds:
    """The finite bounds as G x <= h."""

    def __init__(self, programme: QuadraticProgramme) -> None:
        lower, upper = programme.lower, programme.upper
        narrow = upper - lower < 2.0 * FEASIBLE
        middle = 0.5 * (lower[narrow] + upper[narrow])
        lower, upper = lower.copy(), upper.copy()
        lower[narrow], upper[narrow] = middle - FEASIBLE, middle + FEASIBLE
        self._below, self._above = np.isfinite(upper), np.isfinite(lower)
        rows = sparse.csr_array(programme.rows)
        self.rows = sparse.csr_array(sparse.vstack([rows[self._below], -rows[self._above]]))
        self.limit: Vector = np.concatenate([upper[self._below], -lower[self._above]])

    def multipliers(self, multiplier: Vector) -> Vector:
        """(R,) multipliers of the programme's rows."""
        result, count = np.zeros(len(self._below)), np.count_nonzero(self._below)
        result[self._below] = multiplier[:count]
        result[self._above] -= multiplier[count:]
        return result


def _newton(
    programme: QuadraticProgramme,
    rows: sparse.csr_array,
    slope: Vector,
    missing: Vector,
    distance: Vector,
    multiplier: Vector,
) -> Callable[[Vector], Direction]:
    """The direction for a complementarity (m,) to remove, with the equations factorised.

    Raises:
        LinAlgError: the equations are singular.
    """
    count, weight = len(programme.hessian), multiplier / distance
    own, slacks = rows[:, :count], rows[:, count:]
    weighted = own.T * weight
    normal = programme.hessian + (weighted @ own).toarray()
    mixed = weighted @ slacks
    diagonal = programme.slack_hessian + (slacks.T**2) @ weight
    if len(diagonal):
        normal -= ((mixed / diagonal) @ mixed.T).toarray()
    factor = cho_factor(normal, overwrite_a=True, check_finite=False)

    def solve(complementarity: Vector) -> Direction:
        wanted = -slope - rows.T @ (weight * missing - complementarity / distance)
        forces = cho_solve(factor, wanted[:count] - mixed @ (wanted[count:] / diagonal), check_finite=False)
        move = np.concatenate([forces, (wanted[count:] - mixed.T @ forces) / diagonal])
        far = -missing - rows @ move
        return move, far, -(complementarity + multiplier * far) / distance

    return solve


def _longest(value: Vector, change: Vector, most: float = 1.0) -> float:
    """Longest step, at most `most`, that keeps positive values positive."""
    shrinks = change < 0.0
    return float(min(most, (-value[shrinks] / change[shrinks]).min(initial=np.inf)))
