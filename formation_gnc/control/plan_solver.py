"""Solution of the successive QPs of the MPC, each with a certificate.

A plan within all bounds is a linear map of the error, exactly. Otherwise OSQP, warm-started, solves a saturated
plan in tens of iterations, but stops by residuals, which say little where the cost of thrust is small beside that
of the errors. So its cost is compared with a lower bound on the optimum, and where the two are not close an
interior-point method solves the QP instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import osqp
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor
from scipy.linalg.lapack import dpotrs

from formation_gnc.control.condensed_qp import CondensedQp
from formation_gnc.control.interior_point import interior_point
from formation_gnc.control.mpc_constraints import Bounds, Constraint, PlanInputs, ThrustBox
from formation_gnc.control.quadratic_programme import QuadraticProgramme
from formation_gnc.types import Matrix, Vector

ACCURACY, SECOND_ACCURACY = 1e-4, 1e-6
"""Termination residuals of OSQP, with forces over the force unit; the second if the first is not close enough."""

MAX_ITERATIONS = 300
"""Iterations of OSQP, beyond which the interior-point method is faster."""

OPTIMALITY = 5e-3
"""Largest cost above the lower bound on the optimum, over the cost, of a plan that counts as solved."""

LEAST_COST = 1e-12
"""Cost, scaled, below which a plan is not distinguished from the optimum."""

FEASIBILITY = 1e-3
"""Largest violation of a bound that counts as solved, with forces over the force unit."""

SETTINGS = {
    "verbose": False,
    "eps_abs": ACCURACY,
    "eps_rel": ACCURACY,
    "max_iter": MAX_ITERATIONS,
    "check_termination": 5,
    "adaptive_rho": 1,  # by iterations, not by a clock
    "adaptive_rho_interval": 50,
    "polishing": False,
}
"""OSQP settings: termination and step size depend on iterations alone, so that results are reproducible."""


class SolverError(ArithmeticError):
    """No usable solution; the message is the solver's status, or what is wrong with its solution."""


@dataclass(slots=True)
class Solution:
    """A solution whose cost is within `OPTIMALITY` of the optimum."""

    forces: Matrix
    """(M, 3) over the force unit, within the thrust box."""
    status: str
    iterations: int
    cost: float
    """In the scale of the QP; includes that of free motion."""


class PlanSolver:
    """Solver of QPs of equal sparsity, with one OSQP workspace that is warm-started from plan to plan."""

    def __init__(self, qp: CondensedQp, box: ThrustBox, constraints: Sequence[Constraint]) -> None:
        """Set up the workspace for a QP with a thrust box, whose rows come first, and further constraints."""
        self._constraints = (box, *constraints)
        blocks = [each.rows() for each in self._constraints]
        self.count = blocks[0][0].shape[1]
        """Number of forces, 3 M."""
        self._rows = sparse.csc_array(
            sparse.hstack([sparse.vstack([own for own, _ in blocks]), sparse.block_diag([own for _, own in blocks])])
        )
        self._rows.sort_indices()
        self._columns = self._rows.T
        self._elements = self._force_elements([own.shape[0] for own, _ in blocks])
        ends = self.count + np.cumsum([each.slacks for each in self._constraints])
        self._slacks = [
            (each, slice(end - each.slacks, end))
            for each, end in zip(self._constraints, ends.tolist(), strict=True)
            if each.slacks
        ]
        coordinates = self._rows.tocoo()
        slack = coordinates.col >= self.count
        self._slack_elements = coordinates.row[slack], coordinates.col[slack], coordinates.data[slack]
        self._slack_hessian = np.concatenate([each.slack_hessian() for each in self._constraints])
        self._constant: Bounds | None = None
        pattern = sparse.block_diag(
            [
                sparse.csc_array(np.triu(np.ones((self.count, self.count)))),
                sparse.diags_array(np.ones(len(self._slack_hessian))),
            ],
            format="csc",
        )
        self._box_varies = not box.is_constant
        self._factor: Matrix
        self._adopt(qp)
        self._in_workspace = qp
        pattern.data = self._upper_triangle(qp)
        self.matrices = sparse.csc_matrix(pattern), sparse.csc_matrix(self._rows)
        """Upper triangle of the Hessian, and the rows, as set up."""
        self.workspace = osqp.OSQP()
        rows, variables = self._rows.shape
        self.workspace.setup(
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

    def solve(self, inputs: PlanInputs, gradient: Vector, cost_of_free_motion: float) -> Solution:
        """Solve for the forces, given the gradient (3 M,) and the cost at zero force, both in the scale of the QP.

        Raises:
            SolverError: no feasible plan, or none within `OPTIMALITY` of the optimum.
        """
        if inputs.qp is not self._qp:
            self._adopt(inputs.qp)
        bounds = self._bounds(inputs)
        if bounds.coefficients is not None:
            self._rows.data[:] = bounds.coefficients
        linear = np.zeros(self._rows.shape[1])
        linear[: self.count] = gradient
        for constraint, columns in self._slacks:
            linear[columns] = constraint.slack_gradient(self._qp)
        limits = bounds.lower, bounds.upper
        programme = QuadraticProgramme(
            self._hessian, self._slack_hessian, linear, self._rows, self._columns, *limits, cost_of_free_motion
        )
        return self._within_bounds(programme) or self._by_osqp(programme, bounds) or self._by_interior_point(programme)

    def _adopt(self, qp: CondensedQp) -> None:
        """Expand the Hessian of a QP."""
        self._qp = qp
        self._hessian: Matrix = np.zeros((self.count, self.count))
        self._hessian[np.tril_indices(self.count)] = qp.hessian
        self._hessian += np.tril(self._hessian, -1).T
        self._free: NDArray[np.bool_] | None = None
        """(3 M,) forces that the thrust box does not fix at zero, in the factor in use; None if there is none yet."""

    def _within_bounds(self, programme: QuadraticProgramme) -> Solution | None:
        """The optimum without constraints but those that fix a force, if it violates none."""
        if self._qp.price.any():
            return None
        lower, upper, gradient = programme.lower[: self.count], programme.upper[: self.count], programme.linear
        if self._free is None or (self._box_varies and (self._free != (lower < upper)).any()):
            self._free = free = lower < upper
            self._factor = cho_factor(self._hessian[np.ix_(free, free)], lower=True, check_finite=False)[0]
        point = np.zeros(len(gradient))
        if len(self._factor) == len(gradient):
            point = -dpotrs(self._factor, gradient, lower=1)[0]
        elif len(self._factor):  # LAPACK rejects an empty system
            point[: self.count][self._free] = -dpotrs(self._factor, gradient[: self.count][self._free], lower=1)[0]
        forces = point[: self.count]
        if (forces > upper).any() or (forces < lower).any() or programme.violation(point) > 0.0:
            return None
        cost = programme.offset + 0.5 * float(gradient @ point)
        return Solution(forces.reshape(-1, 3), "solved", 1, cost)

    def _by_osqp(self, programme: QuadraticProgramme, bounds: Bounds) -> Solution | None:
        """OSQP's solution, if it is certified at either accuracy.

        Raises:
            SolverError: there is no feasible plan.
        """
        if self._in_workspace is not self._qp:
            self._in_workspace = self._qp
            self.workspace.update(Px=self._upper_triangle(self._qp))
        rows = {} if bounds.coefficients is None else {"Ax": bounds.coefficients}
        self.workspace.update(q=programme.linear, l=bounds.lower, u=bounds.upper, **rows)
        solution = self._run_osqp(programme)
        if solution is None:
            self.workspace.update_settings(eps_abs=SECOND_ACCURACY, eps_rel=SECOND_ACCURACY)
            solution = self._run_osqp(programme)
            self.workspace.update_settings(eps_abs=ACCURACY, eps_rel=ACCURACY)
        return solution

    def _run_osqp(self, programme: QuadraticProgramme) -> Solution | None:
        """One run of OSQP to its accuracy; as `_by_osqp`."""
        result = self.workspace.solve(raise_error=False)
        status = result.info.status_val
        if status in (osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE, osqp.SolverStatus.OSQP_DUAL_INFEASIBLE):
            self.workspace.warm_start(x=np.zeros(len(result.x)), y=np.zeros(len(result.y)))
            raise SolverError(result.info.status)
        if not (np.isfinite(result.x).all() and np.isfinite(result.y).all()):
            self.workspace.warm_start(x=np.zeros(len(result.x)), y=np.zeros(len(result.y)))
            return None
        return self._certified(programme, result.x, result.y, int(result.info.iter))

    def _by_interior_point(self, programme: QuadraticProgramme) -> Solution:
        """The interior-point method's solution; raises SolverError if it is not certified."""
        try:
            point, multipliers, iterations = interior_point(programme)
        except (LinAlgError, ValueError) as error:
            raise SolverError(str(error)) from error
        solution = self._certified(programme, point, multipliers, iterations)
        if solution is None:
            raise SolverError(f"no plan within {OPTIMALITY:.1%} of the optimum found")
        return solution

    def _certified(
        self, programme: QuadraticProgramme, point: Vector, multipliers: Vector, iterations: int
    ) -> Solution | None:
        """The forces within the thrust box and their cost; None if it is not within `OPTIMALITY` of the optimum."""
        count = self.count
        exact = np.minimum(np.maximum(point[:count], programme.lower[:count]), programme.upper[:count])
        if len(point) > count:
            exact = np.concatenate([exact, np.zeros(len(point) - count)])
            row, column, sign = self._slack_elements
            values = (programme.rows @ exact)[row]
            short = np.where(sign > 0.0, programme.lower[row] - values, values - programme.upper[row])
            np.maximum.at(exact, column, short)
        if programme.violation(exact) > FEASIBILITY:
            return None
        cost, least = programme.bracket(exact, multipliers)
        if not cost - least <= OPTIMALITY * cost + LEAST_COST:
            return None
        return Solution(exact[:count].reshape(-1, 3), "solved", iterations, cost)

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

    def _upper_triangle(self, qp: CondensedQp) -> Vector:
        return np.concatenate([qp.hessian, self._slack_hessian])
