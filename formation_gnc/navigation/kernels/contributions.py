"""Shares of sensors in the covariance of an estimate."""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from formation_gnc.navigation.kernels.linear_algebra import congruence, product
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, kernel
from formation_gnc.types import Matrix, Vector


@kernel((float64[:, :, ::1], int64[::1], float64, ANY_MATRIX, ANY_MATRIX, ANY_MATRIX, ANY_VECTOR))
def update_contributions(
    contributions: Matrix,
    sensors: NDArray[np.int64],
    memory: float,
    transition: Matrix,
    covariance: Matrix,
    jacobian: Matrix,
    variance: Vector,
) -> None:
    """Propagate what the noise of each sensor contributes to a covariance through an update.

    With the gain K = P H' R^-1 of the updated covariance: C = (I - K H) Phi C Phi' (I - K H)' for every sensor, and
    K R K' of its own values is added to that of each sensor.

    Args:
        contributions: (s, 6, 6), written into.
        sensors: (m,) sensor of each value.
        memory: factor on the older contribution of a sensor that reads.
        transition: (6, 6) since the last update.
        covariance: (6, 6) after the update.
        jacobian: (m, 6).
        variance: (m,) of the noise.
    """
    gain = product(covariance, jacobian.T / variance)
    closed = product(np.eye(6) - product(gain, jacobian), transition)
    nothing = np.zeros((6, 6))
    for sensor in range(contributions.shape[0]):
        contributions[sensor] = congruence(closed, contributions[sensor], nothing)
        if (sensors == sensor).any():
            contributions[sensor] *= memory
    for row in range(len(variance)):
        contributions[sensors[row]] += np.outer(gain[:, row], gain[:, row]) * variance[row]
