"""States at the ends of equal steps, as linear maps of the start and of the accelerations held over the steps."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.relative.model import INPUT, LinearModel
from formation_gnc.types import Matrix, Vector

NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Of the quadrature over a step: exact to the sixth power of the angle that the chief moves in it."""

QUARTERS = np.arange(5) / 4.0
"""Of a revolution, at which the error after the end is looked at."""


@dataclass(frozen=True)
class ThrustResponse:
    """With accelerations u_k held over the steps, x_j = free_j (x_0 + sum over k < j of pushed_k u_k)."""

    step: float
    """Length of a step, s."""
    free: Matrix
    """(N + 1 + M, 6, 6) transition matrices from the start to the ends of the steps, and of M steps of coasting."""
    pushed: Matrix
    """(N, 6, 3) effect of an acceleration of a step, at the start."""
    after: Matrix
    """(5, 6, 6) transition matrices from the end of the steps with thrust to the quarters of a revolution after it."""

    @classmethod
    def of(cls, model: LinearModel, time: float, step: float, count: int, coasting: int) -> "ThrustResponse":
        """Response of a model from a time (s) over a number of steps (s) with thrust, and of a number without."""
        begins = step * np.arange(count)
        middles = (begins[:, None] + 0.5 * step * (1.0 + NODES)).ravel()
        units = np.repeat([1.0, np.sum(model.phase_rates(time)) / 2.0], 3)
        scaled = model.transitions(time, middles) * (units / units[:, None])
        # Phi^-1 B, in units that keep the inverse well conditioned over many revolutions.
        effects = units[:, None] * np.linalg.solve(scaled, np.broadcast_to(INPUT / units[:, None], (len(scaled), 6, 3)))
        pushed = 0.5 * step * np.einsum("m,kmij->kij", WEIGHTS, effects.reshape(count, len(NODES), 6, 3))
        ends: Vector = step * np.arange(count + 1 + coasting, dtype=np.float64)
        free = model.transitions(time, ends)
        return cls(step, free, pushed, model.transitions(time + step * count, model.period * QUARTERS))

    @property
    def count(self) -> int:
        """Steps with thrust, N."""
        return len(self.pushed)

    def origins(self, start: Vector, accelerations: Matrix) -> Matrix:
        """(N + 1, 6) states at the start of whose free motion the steps' ends lie, by accelerations (N, 3)."""
        moved = np.cumsum(np.einsum("kij,kj->ki", self.pushed, accelerations), axis=0)
        result: Matrix = np.asarray(start) + np.vstack([np.zeros(6), moved])
        return result
