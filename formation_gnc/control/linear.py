"""Linear controllers: what a law is without limits."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from formation_gnc.types import Matrix


@dataclass(frozen=True)
class LinearController:
    """States xi of a controller of a measured error v: dxi/dt = A xi + B v, u = C xi + D v; or the same per
    tick."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix

    def discretised(self, tick: float) -> "LinearController":
        """Exact for an error held over the tick."""
        size, inputs = self.b.shape
        joint = np.zeros((size + inputs, size + inputs))
        joint[:size, :size], joint[:size, size:] = self.a, self.b
        joint = expm(joint * tick)
        return LinearController(joint[:size, :size], joint[:size, size:], self.c, self.d)

    def closed_loop(self, a: Matrix, b: Matrix) -> Matrix:
        """(6 + n, 6 + n) matrix of plant and controller together, for a plant a (6, 6), b (6, 3), both per
        tick or not."""
        seen = np.eye(6)[: self.b.shape[1]]
        return np.block([[a + b @ self.d @ seen, b @ self.c], [self.b @ seen, self.a]])
