"""OSQP on the successive QPs of the MPC."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from formation_gnc.control.condensed_qp import CondensedQp
from formation_gnc.control.mpc_constraints import Bounds, Constraint, PlanInputs, ThrustBox
from formation_gnc.types import Matrix, Vector

ACCURACY = 1e-4
"""Termination residual of OSQP, with forces over the force unit."""

MAX_ITERATIONS = 2000
"""Iterations without convergence that count as failure: some ten milliseconds at 30 steps."""

SETTINGS = {
    "verbose": False,
    "eps_abs": ACCURACY,
    "eps_rel": ACCURACY,
    "max_iter": MAX_ITERATIONS,
    "check_termination": 10,
    "adaptive_rho": 1,  # by iterations, not by a clock
    "adaptive_rho_interval": 50,
    "polishing": False,
}
"""OSQP settings: termination and step size depend on iterations alone, so that results are reproducible."""


class SolverError(ArithmeticError):
    """No usable solution; the message is OSQP's status, or what is wrong with its solution."""


@dataclass(slots=True)
class Solution:
    """A solution within the accuracy of the solver."""

    forces: Matrix
    """(M, 3) over the force unit, within the thrust box."""
    status: str
    iterations: int
    objective: float
    """In the scale of the QP."""


class OsqpSession:
    """One OSQP workspace for QPs of equal sparsity, warm-started from solution to solution."""

    def __init__(self, qp: CondensedQp, box: ThrustBox, constraints: Sequence[Constraint]) -> None:
        """Set up the workspace for a QP with a thrust box, whose rows come first, and further constraints."""
        self._qp = qp
        self._constraints = (box, *constraints)
        blocks = [each.rows() for each in self._constraints]
        self.count = blocks[0][0].shape[1]
        """Number of forces, 3 M."""
        self._rows = sparse.csc_array(
            sparse.hstack([sparse.vstack([own for own, _ in blocks]), sparse.block_diag([own for _, own in blocks])])
        )
        self._rows.sort_indices()
        self._elements = self._force_elements([own.shape[0] for own, _ in blocks])
        ends = self.count + np.cumsum([each.slacks for each in self._constraints])
        self._slacks = [
            (each, slice(end - each.slacks, end))
            for each, end in zip(self._constraints, ends.tolist(), strict=True)
            if each.slacks
        ]
        self._slack_hessian = np.concatenate([each.slack_hessian() for each in self._constraints])
        self._constant: Bounds | None = None
        pattern = sparse.block_diag(
            [
                sparse.csc_array(np.triu(np.ones((self.count, self.count)))),
                sparse.diags_array(np.ones(len(self._slack_hessian))),
            ],
            format="csc",
        )
        pattern.data = self._hessian(qp)
        self.matrices = sparse.csc_matrix(pattern), sparse.csc_matrix(self._rows)
        """Upper triangle of the Hessian, and the rows, as set up."""
        self.solver = osqp.OSQP()
        rows, variables = self._rows.shape
        self.solver.setup(
            self.matrices[0],
            np.zeros(variables),
            self.matrices[1],
            np.full(rows, -1.0),
            np.full(rows, 1.0),
            **SETTINGS,
        )

    def figures(self) -> dict[str, int]:
        """Size of the QP."""
        rows, variables = self._rows.shape
        return {
            "variables": variables,
            "constraints": rows,
            "entries of Hessian and constraints": self._rows.nnz + self.matrices[0].nnz,
        }

    def solve(self, inputs: PlanInputs, gradient: Vector) -> Solution:
        """Solve for the forces, given the gradient (3 M,) at zero force.

        Raises:
            SolverError: OSQP has not converged, or its solution is not finite or outside the thrust box.
        """
        if inputs.qp is not self._qp:
            self._qp = inputs.qp
            self.solver.update(Px=self._hessian(self._qp))
        bounds = self._bounds(inputs)
        linear = np.zeros(self._rows.shape[1])
        linear[: self.count] = gradient
        for constraint, columns in self._slacks:
            linear[columns] = constraint.slack_gradient(self._qp)
        rows = {} if bounds.coefficients is None else {"Ax": bounds.coefficients}
        self.solver.update(q=linear, l=bounds.lower, u=bounds.upper, **rows)
        result = self.solver.solve(raise_error=False)
        solution, status = result.x, result.info.status
        if result.info.status_val != osqp.SolverStatus.OSQP_SOLVED or not np.isfinite(solution).all():
            self.solver.warm_start(x=np.zeros(len(linear)), y=np.zeros(len(bounds.lower)))
            raise SolverError(status)
        exact = solution[: self.count]
        forces = np.clip(exact, bounds.lower[: self.count], bounds.upper[: self.count])
        if np.abs(forces - exact).max() > 100.0 * ACCURACY:
            raise SolverError(f"{status}, but outside the thrust limit")
        return Solution(forces.reshape(-1, 3), status, int(result.info.iter), result.info.obj_val)

    def _bounds(self, inputs: PlanInputs) -> Bounds:
        """Bounds of all rows, and all elements of the rows if any of them change."""
        if self._constant is not None:
            return self._constant
        parts = [each.bounds(inputs) for each in self._constraints]
        data: Vector | None = None
        for part, elements in zip(parts, self._elements, strict=True):
            if part.coefficients is not None:
                data = self._rows.data.copy() if data is None else data
                data[elements] = part.coefficients
        bounds = Bounds(
            np.concatenate([each.lower for each in parts]), np.concatenate([each.upper for each in parts]), data
        )
        if all(each.is_constant for each in self._constraints):
            self._constant = bounds
        return bounds

    def _force_elements(self, sizes: Sequence[int]) -> list[NDArray[np.int_]]:
        """Positions of each constraint's force coefficients in the data of the rows, column by column."""
        column = np.repeat(np.arange(self._rows.shape[1]), np.diff(self._rows.indptr))
        owner = np.repeat(np.arange(len(sizes)), sizes)[self._rows.indices]
        return [np.flatnonzero((owner == index) & (column < self.count)) for index in range(len(sizes))]

    def _hessian(self, qp: CondensedQp) -> Vector:
        return np.concatenate([qp.hessian, self._slack_hessian])
