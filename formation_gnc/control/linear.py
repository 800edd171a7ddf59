"""Linear controllers in state-space form."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from formation_gnc.types import Matrix


@dataclass(frozen=True)
class LinearController:
    """State-space controller of a measured error v: dxi/dt = A xi + B v, u = C xi + D v; or sampled, per tick.

    The error is the relative state (6) or the relative position (3); u is an acceleration (3).
    """

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix

    def discretised(self, tick: float) -> "LinearController":
        """The controller sampled every `tick` (s): exact for an error held over the tick."""
        size, inputs = self.b.shape
        joint = np.zeros((size + inputs, size + inputs))
        joint[:size, :size], joint[:size, size:] = self.a, self.b
        joint = expm(joint * tick)
        return LinearController(joint[:size, :size], joint[:size, size:], self.c, self.d)

    def closed_loop(self, a: Matrix, b: Matrix) -> Matrix:
        """(6 + n, 6 + n) closed-loop matrix with a plant a (6, 6), b (6, 3); both sampled or both continuous."""
        output = np.eye(6)[: self.b.shape[1]]
        return np.block([[a + b @ self.d @ output, b @ self.c], [self.b @ output, self.a]])
