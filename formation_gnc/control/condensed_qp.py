"""The condensed quadratic programme (QP) of the MPC: states eliminated, forces as variables."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.model import RelativeModel
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class PlanCost:
    """Cost of a plan: the errors at the ends of its steps, and the forces."""

    running: Matrix
    """(6, 6) weight of the error at the end of every step but the last."""
    terminal: Matrix
    """(K, 6, 6) weight at the end of the horizon, at K equal intervals of the orbit; K is 1 if constant."""
    thrust: Matrix
    """(3, 3) weight of the scaled force of a step."""
    absolute: bool
    """Whether the cost is linear in the magnitudes of the forces, instead of quadratic."""


@dataclass(frozen=True)
class CondensedQp:
    """The QP from one point of the orbit, over N steps with forces in the first M, scaled by the force unit."""

    transitions: Matrix
    """(N, 6, 6) state transition matrix of each step."""
    free: Matrix
    """(6 N, 6) states at the ends of the steps, from the initial state."""
    forced: Matrix
    """(6 N, 3 M) states at the ends of the steps, from the forces."""
    weight: Matrix
    """(N, 6, 6) weight of the error at the end of each step."""
    hessian: Vector
    """Upper triangle of the scaled Hessian (3 M, 3 M), column by column."""
    gradient: Matrix
    """(3 M, 6 N) scaled gradient at zero force, from the errors of free motion."""
    gradient_of_state: Matrix
    """(3 M, 6) scaled gradient at zero force, from the initial error."""
    cost_of_state: Matrix
    """(6, 6) cost of free motion, from the initial error."""
    price: Vector
    """(3 M,) scaled linear cost of the magnitudes of the forces."""
    scale: float
    """Scaled cost over cost."""

    @classmethod
    def condense(cls, phi: Matrix, gamma: Matrix, steps: int, cost: PlanCost, terminal: Matrix) -> "CondensedQp":
        """Eliminate the states of phi (N, 6, 6), gamma (N, 6, 3), with forces in the first `steps` of N steps.

        `terminal` (6, 6) is the cost's weight at the end of this horizon.
        """
        horizon, count = len(phi), 3 * steps
        free, forced = np.empty((horizon, 6, 6)), np.empty((horizon, 6, count))
        state, response = np.eye(6), np.zeros((6, count))
        for step in range(horizon):
            state, response = phi[step] @ state, phi[step] @ response
            if step < steps:
                response[:, 3 * step : 3 * step + 3] += gamma[step]
            free[step], forced[step] = state, response
        weight = np.repeat(cost.running[None], horizon, axis=0)
        weight[-1] = terminal
        weighted = (weight @ forced).reshape(6 * horizon, count)
        unforced = free.reshape(6 * horizon, 6)
        stacked = forced.reshape(6 * horizon, count)
        hessian = stacked.T @ weighted
        price = np.zeros(count)
        if cost.absolute:
            price = np.tile(np.sqrt(np.diag(cost.thrust)), steps) / 2.0
        else:
            hessian += np.kron(np.eye(steps), cost.thrust)
        scale = 1.0 / float(np.diag(hessian).mean())
        return cls(
            phi,
            unforced,
            stacked,
            weight,
            scale * hessian.T[np.tril_indices(count)],
            scale * weighted.T,
            scale * weighted.T @ unforced,
            unforced.T @ (weight @ free).reshape(6 * horizon, 6),
            scale * price,
            scale,
        )

    def tracking(self, estimate: NavigationState, target: Target, step: int) -> tuple[Vector, float]:
        """Scaled gradient (3 M,) at zero force, and the cost there, for steps of a length in ns.

        Follows the target's preview if its step is that of the QP, and free motion from its end.
        """
        if not len(target.preview) or target.preview_step != step:
            # A target in free motion: the error moves freely as well.
            error = estimate.relative_state - target.relative_state
            return self.gradient_of_state @ error, float(error @ self.cost_of_state @ error)
        horizon = len(self.transitions)
        goals = np.empty((horizon, 6))
        previewed = min(len(target.preview), horizon)
        goals[:previewed] = target.preview[:previewed]
        for index in range(previewed, horizon):
            goals[index] = self.transitions[index] @ goals[index - 1]
        errors = (self.free @ estimate.relative_state).reshape(horizon, 6) - goals
        weighted = (self.weight @ errors[:, :, None])[:, :, 0]
        return self.gradient @ errors.ravel(), float(np.sum(errors * weighted))


def condense_along_orbit(
    model: RelativeModel, step: float, horizon: int, steps: int, cost: PlanCost, unit: float, intervals: int
) -> list[CondensedQp]:
    """The QP from each of a number of equal intervals of the orbit; one interval for a time-invariant model.

    Args:
        model: relative motion, tabulated at the intervals and interpolated between them.
        step: length of a step, s.
        horizon: number of steps N.
        steps: number of steps with forces M.
        cost: of the plan.
        unit: acceleration by one scaled force, m/s^2.
        intervals: number of starting points.
    """
    grid = model.period / intervals * np.arange(intervals)
    table = [model.discretise(float(time), step) for time in grid]
    phi, gamma = (np.array(each) for each in zip(*table, strict=True))
    qps = []
    for start in range(intervals):
        position = start + step * np.arange(horizon + 1) * intervals / model.period
        below = np.floor(position).astype(int)
        fraction = (position - below)[:, None, None]
        along = [
            (1.0 - fraction) * each[below % intervals] + fraction * each[(below + 1) % intervals]
            for each in (phi, gamma)
        ]
        terminal = cost.terminal[below[-1] % len(cost.terminal)]
        qps.append(CondensedQp.condense(along[0][:-1], along[1][:-1] * unit, steps, cost, terminal))
    return qps
