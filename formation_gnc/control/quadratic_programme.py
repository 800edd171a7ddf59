"""The quadratic programme (QP) of one plan, and the bound on its optimum that certifies a solution."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from formation_gnc.types import Matrix, Vector


@dataclass(slots=True)
class QuadraticProgramme:
    """Minimise x' P x / 2 + q' x subject to l <= A x <= u, over forces and slacks x.

    P has a block for the forces and is diagonal in the slacks. The first rows of A are the forces themselves: the
    thrust box. No other row has more than one slack.
    """

    hessian: Matrix
    """(F, F) block of P for the forces."""
    slack_hessian: Vector
    """(S,) diagonal of P for the slacks."""
    linear: Vector
    """(F + S,) q."""
    rows: sparse.csc_array
    """(R, F + S) A."""
    columns: sparse.csr_array
    """(F + S, R) A', a view of the same elements."""
    lower: Vector
    """(R,) l, -inf for none."""
    upper: Vector
    """(R,) u, inf for none."""
    offset: float
    """Cost of zero force, with which the cost of every plan is positive."""

    @property
    def is_box(self) -> bool:
        """Whether the thrust box is all that bounds the forces, with no slack."""
        return len(self.lower) == len(self.linear) == len(self.hessian)

    def curve(self, point: Vector) -> Vector:
        """P x (F + S,) at a point x (F + S,)."""
        count = len(self.hessian)
        if not len(self.slack_hessian):
            return np.asarray(self.hessian @ point)
        return np.concatenate([self.hessian @ point[:count], self.slack_hessian * point[count:]])

    def cost(self, point: Vector) -> float:
        """Cost of a point (F + S,), with the offset."""
        return float(point @ (0.5 * self.curve(point) + self.linear)) + self.offset

    def violation(self, point: Vector) -> float:
        """Largest violation of a bound other than the thrust box at a point (F + S,)."""
        count = len(self.hessian)
        if len(self.lower) == count:
            return 0.0
        values = (self.rows @ point)[count:]
        return float(max((self.lower[count:] - values).max(), (values - self.upper[count:]).max(), 0.0))

    def bracket(self, point: Vector, multipliers: Vector) -> tuple[float, float]:
        """Cost of a point (F + S,), and a lower bound on that of any plan: the dual cost, tight at the solution.

        Both with the offset. For any y, and x the forces: P is convex and y' A z at most its support over l and u, so
        that the cost of z is at least q' z + x' P z - x' P x / 2 + y' A z - support(y). The least of it over the thrust
        box, and over slacks of any size where they have a quadratic cost, else of a size that a force has.
        """
        count, curve = len(self.hessian), self.curve(point)
        cost = float(point @ (0.5 * curve + self.linear)) + self.offset
        above, below = np.maximum(multipliers, 0.0), np.minimum(multipliers, 0.0)
        if self.is_box:
            push = multipliers + self.linear
            support = float(above @ self.upper + below @ self.lower)
        else:
            # No bound, no multiplier.
            bounded = np.isfinite(self.upper), np.isfinite(self.lower)
            above, below = np.where(bounded[0], above, 0.0), np.where(bounded[1], below, 0.0)
            support = float(above[bounded[0]] @ self.upper[bounded[0]] + below[bounded[1]] @ self.lower[bounded[1]])
            push = self.columns @ (above + below) + self.linear
        forces, own = point[:count], curve[:count]
        box = np.maximum(-self.lower[:count], self.upper[:count])
        least = self.offset - support - 0.5 * float(forces @ own) - float(box @ np.abs(push[:count] + own))
        if len(self.slack_hessian):
            slacks, squares = push[count:], self.slack_hessian > 0.0
            least -= 0.5 * float(np.sum(slacks[squares] ** 2 / self.slack_hessian[squares]))
            least -= float(box.max() * np.abs(slacks[~squares]).sum())
        return cost, least
