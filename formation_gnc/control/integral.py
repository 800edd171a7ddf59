"""Optional integral action on the position error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix


@dataclass(frozen=True)
class IntegralWeights(QuadraticWeights):
    """Quadratic weights, with one on the integral of the position error as three further states."""

    integral_error: float = parameter(
        0.0,
        unit="m s",
        minimum=0.0,
        in_flight=True,
        doc="integral of position error with unit cost; 0 for no integral action",
    )

    @property
    def integrates(self) -> bool:
        """Whether the law has integral action."""
        return self.integral_error > 0.0

    def joint_matrix(self) -> Matrix:
        """Q (6, 6), or (9, 9) with the integral; raises DesignError as `state_matrix`."""
        q = self.state_matrix()
        return np.asarray(block_diag(q, np.eye(3) / self.integral_error**2)) if self.integrates else q


def with_integral(
    dynamics: Matrix, inputs: Matrix, kept: Matrix | float = 0.0, rate: float = 1.0
) -> tuple[Matrix, Matrix]:
    """Model (6, 6), (6, 3) augmented by the integral of position: (9, 9) and (9, 3).

    The defaults augment a continuous model; a discrete one has `kept` the identity and `rate` the step, s.
    """
    joint = np.zeros((9, 9))
    joint[:6, :6] = dynamics
    joint[6:, 6:] = kept
    joint[6:, :3] = rate * np.eye(3)
    return joint, np.vstack([inputs, np.zeros((3, 3))])


def integrated(
    integral: Sequence[float],
    error: Sequence[float],
    force: Sequence[float],
    limit: Sequence[float],
    tick: float,
) -> list[float]:
    """The integral (3,), m s, after a tick (s) of position error (3,), m.

    Anti-windup by clamping: an axis whose force (3,), N, is at its limit (3,), N, does not integrate.
    """
    return [
        total + offset * tick if abs(value) < largest else total
        for total, offset, value, largest in zip(integral, error, force, limit, strict=True)
    ]
