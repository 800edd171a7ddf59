"""Integral action, for the laws that have it on request."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix


@dataclass(frozen=True)
class IntegralWeights(QuadraticWeights):
    """And the weight of the integral of the position error, three more states of a law that has it."""

    integral_error: float = parameter(
        0.0,
        unit="m s",
        minimum=0.0,
        in_flight=True,
        doc="integral of position error that weighs one; 0 for no integral",
    )

    @property
    def integrates(self) -> bool:
        """Whether there is an integral."""
        return self.integral_error > 0.0

    def joint_matrix(self) -> Matrix:
        """Q (6, 6), or (9, 9) with the integral; raises DesignError as `state_matrix`."""
        q = self.state_matrix()
        return np.asarray(block_diag(q, np.eye(3) / self.integral_error**2)) if self.integrates else q


def with_integral(
    dynamics: Matrix, inputs: Matrix, kept: Matrix | float = 0.0, rate: float = 1.0
) -> tuple[Matrix, Matrix]:
    """Dynamics (9, 9) and inputs (9, 3) of a model, (6, 6) and (6, 3), with the integral of position.

    Continuous as it stands; of steps, `kept` is what stays of the integral and `rate` the step, s.
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
    """The integral (3,), m s, after a tick (s) with a position error (3,), m.

    Anti-wind-up: what an axis at its limit (3,), N, cannot give, more integral would not get.
    """
    return [
        total + off * tick if abs(value) < most else total
        for total, off, value, most in zip(integral, error, force, limit, strict=True)
    ]
