"""The second-order cone programme (SOCP) of a thrust history, assembled as sparse matrices and solved by Clarabel."""

from dataclasses import dataclass, field
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from formation_gnc.types import Matrix, Vector

MAX_ITERATIONS = 200

ACCURACY = 1e-6
"""Largest force above its limit, over it, of a solution that counts as within; it is cut then."""

LEAST = 1e-6
"""Force over the limit below which the solver's accuracy gives it, not the plan."""

Rows = tuple[Matrix, Vector]
"""A (M, 3 K) and b (M,) of A f + b, linear in the forces f."""


class ConeError(ArithmeticError):
    """No usable solution; the message is the solver's status, or what is wrong with its solution."""


@dataclass
class ConeProgramme:
    """Minimise the price of the magnitudes of K forces, plus that of a slack, under linear and cone constraints."""

    limits: Matrix
    """(K, 3) largest force per axis; zero for an axis without thrust, which is left out."""
    total: float
    """Limit on the magnitude of a force, which then has the price; 0 for none: then each axis has it."""
    price: Vector
    """(K,) of a magnitude."""
    slack_price: float
    end: Rows
    """Few combinations z = A f + b of all forces."""
    soft: Rows
    """A z + b + slack >= 0, with one slack; in z, since many rows that meet all forces are dear."""
    above: list[Rows] = field(default_factory=list)
    """A f + b >= 0."""
    cones: list[Rows] = field(default_factory=list)
    """y = A f + b with |y[1:]| <= y[0]."""

    def solve(self) -> tuple[Matrix, float, int]:
        """Forces (K, 3), the slack and the number of iterations; the same bits for the same programme.

        Raises:
            ConeError: not solved.
        """
        used = np.flatnonzero(self.limits.ravel() > 0.0)
        if not len(used):
            raise ConeError("no thrust allowed")
        groups, member = np.unique(used // 3, return_inverse=True)
        if self.total > 0.0:
            blocks, cones = self._by_magnitude(used, member)
            price = self.price[groups]
        else:
            blocks, cones = self._by_axis(used)
            price = self.price[used // 3]
        self._constrain(used, len(price), blocks, cones)
        linear = np.concatenate([np.zeros(len(used)), price, np.zeros(len(self.end[0])), [self.slack_price]])
        rows = sparse.csc_matrix(sparse.vstack([each for each, _ in blocks]))
        constants = np.concatenate([each for _, each in blocks])
        zero = sparse.csc_matrix((len(linear), len(linear)))
        found = clarabel.DefaultSolver(zero, linear, rows, constants, cones, solver_settings()).solve()
        if found.status != clarabel.SolverStatus.Solved:
            raise ConeError(str(found.status))
        point = np.array(found.x)
        forces = np.zeros(self.limits.size)
        forces[used] = point[: len(used)]
        return forces.reshape(-1, 3), float(point[-1]), int(found.iterations)

    def within_limits(self, forces: Matrix) -> Matrix:
        """Forces (K, 3) cut to the limits; raises ConeError if that is more than the solver's accuracy."""
        if not np.isfinite(forces).all() or (np.abs(forces) - self.limits).max() > ACCURACY:
            raise ConeError("solution beyond the thrust limit")
        cut = np.clip(forces, -self.limits, self.limits)
        if self.total > 0.0:
            sizes = np.linalg.norm(cut, axis=1)
            if sizes.max() > self.total * (1.0 + ACCURACY):
                raise ConeError("solution beyond the limit of the total thrust")
            cut = cut * np.minimum(1.0, self.total / np.maximum(sizes, 1e-300))[:, None]
        return np.where(np.abs(cut) < LEAST * self.limits, 0.0, cut)

    def _by_axis(self, used: NDArray[np.int_]) -> tuple[list[tuple[Any, Vector]], list[Any]]:
        """Blocks of A x + s = b and cones of s: each force within its magnitude, and that within its limit."""
        count, eye = len(used), sparse.identity(len(used), format="csr")
        blocks = [
            (self._block(0.0 * eye, eye), self.limits.ravel()[used]),
            (self._block(eye, -eye), np.zeros(count)),
            (self._block(-eye, -eye), np.zeros(count)),
        ]
        return blocks, [clarabel.NonnegativeConeT(3 * count)]

    def _by_magnitude(
        self, used: NDArray[np.int_], member: NDArray[np.int_]
    ) -> tuple[list[tuple[Any, Vector]], list[Any]]:
        """As `_by_axis`, with one magnitude for all axes of a force."""
        count, sizes = len(used), np.bincount(member)
        eye, own, bound = sparse.identity(count), sparse.identity(len(sizes)), self.limits.ravel()[used]
        blocks = [
            (self._block(sparse.csr_matrix((len(sizes), count)), own), np.full(len(sizes), self.total)),
            (self._block(eye, sparse.csr_matrix((count, len(sizes)))), bound),
            (self._block(-eye, sparse.csr_matrix((count, len(sizes)))), bound),
        ]
        height, tops = count + len(sizes), np.cumsum(sizes + 1) - sizes - 1
        places = np.arange(count) + member + 1
        forces = sparse.csr_matrix((-np.ones(count), (places, np.arange(count))), (height, count))
        magnitudes = sparse.csr_matrix((-np.ones(len(sizes)), (tops, np.arange(len(sizes)))), (height, len(sizes)))
        blocks.append((self._block(forces, magnitudes), np.zeros(height)))
        cones = [clarabel.NonnegativeConeT(2 * count + len(sizes))]
        return blocks, cones + [clarabel.SecondOrderConeT(int(size) + 1) for size in sizes]

    def _constrain(
        self, used: NDArray[np.int_], magnitudes: int, blocks: list[tuple[Any, Vector]], cones: list[Any]
    ) -> None:
        """Append the end, the slack's sign and the constraints on the forces."""

        ends = len(self.end[0])

        def append(forces: Any, others: Matrix, constant: Vector, cone: Any) -> None:
            zero = sparse.csr_matrix((len(constant), magnitudes))
            blocks.append((sparse.hstack([-forces, zero, sparse.csr_matrix(-others)]), constant))
            cones.append(cone(len(constant)))

        rows, constant = self.end
        append(sparse.csr_matrix(rows[:, used]), -np.eye(ends, ends + 1), constant, clarabel.ZeroConeT)
        rows, constant = self.soft
        height, none = len(constant), sparse.csr_matrix
        append(none((height, len(used))), np.hstack([rows, np.ones((height, 1))]), constant, clarabel.NonnegativeConeT)
        append(none((1, len(used))), np.eye(1, ends + 1, ends), np.zeros(1), clarabel.NonnegativeConeT)
        for found, cone in ((self.above, clarabel.NonnegativeConeT), (self.cones, clarabel.SecondOrderConeT)):
            for rows, constant in found:
                append(sparse.csr_matrix(rows[:, used]), np.zeros((len(rows), ends + 1)), constant, cone)

    def _block(self, forces: Any, magnitudes: Any) -> Any:
        """Rows of the forces and the magnitudes alone."""
        return sparse.hstack([forces, magnitudes, sparse.csr_matrix((forces.shape[0], len(self.end[0]) + 1))])


def solver_settings() -> Any:
    """Clarabel's: one thread and no clock, so that results are reproducible."""
    result = clarabel.DefaultSettings()
    result.verbose = False
    result.max_iter = MAX_ITERATIONS
    result.max_threads = 1
    result.direct_solve_method = "qdldl"
    result.presolve_enable = False
    return result
