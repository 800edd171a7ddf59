"""Gravity of the point mass with J2, and its gradient: the model of filters and plans."""

from math import sqrt

import numpy as np
from numba import float64
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.jit import ANY_VECTOR, inline, kernel

OBLATENESS = 1.5 * J2 * MU * EARTH_RADIUS**2
"""Strength of J2, 3/2 J2 mu R^2, m^5/s^2."""


@inline
def oblate_acceleration(
    x: float, y: float, z: float, mu: float = MU, oblateness: float = OBLATENESS
) -> tuple[float, float, float]:
    """Acceleration by the point mass with J2, component-wise, m/s^2; `oblateness` is 3/2 J2 mu R^2."""
    r2 = x * x + y * y + z * z
    r = sqrt(r2)
    central = mu / (r2 * r)
    oblate = oblateness / (r2 * r2 * r)
    polar = 5.0 * z * z / r2
    equatorial = -(central + oblate * (1.0 - polar))
    return x * equatorial, y * equatorial, -z * (central + oblate * (3.0 - polar))


@inline
def oblate_gradient(
    x: float, y: float, z: float, mu: float = MU, oblateness: float = OBLATENESS
) -> tuple[float, float, float, float, float, float]:
    """Gradient of `oblate_acceleration`: its components xx, xy, xz, yy, yz, zz, 1/s^2."""
    r2 = x * x + y * y + z * z
    r = sqrt(r2)
    r5 = r2 * r2 * r
    central = mu / r5
    oblate = oblateness / (r5 * r2)
    z2 = z * z
    outer = 3.0 * central + oblate * (5.0 - 35.0 * z2 / r2)
    diagonal = -central * r2 - oblate * (r2 - 5.0 * z2)
    return (
        diagonal + outer * x * x,
        outer * x * y,
        (outer + 10.0 * oblate) * x * z,
        diagonal + outer * y * y,
        (outer + 10.0 * oblate) * y * z,
        -central * r2 - oblate * (3.0 * r2 - 5.0 * z2) + (outer + 20.0 * oblate) * z2,
    )


@kernel(float64[::1](ANY_VECTOR))
def acceleration(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Acceleration by the point mass with J2.

    Args:
        position: inertial, (3,), m, or the state it begins, (6,).

    Returns:
        (3,), m/s^2, inertial.
    """
    out = np.empty(3)
    out[0], out[1], out[2] = oblate_acceleration(position[0], position[1], position[2])
    return out


@kernel(float64[:, ::1](ANY_VECTOR))
def gradient(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradient of `acceleration` with respect to position; symmetric and traceless.

    Args:
        position: inertial, (3,), m.

    Returns:
        (3, 3), 1/s^2, inertial.
    """
    xx, xy, xz, yy, yz, zz = oblate_gradient(position[0], position[1], position[2])
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = xx, yy, zz
    out[0, 1] = out[1, 0] = xy
    out[0, 2] = out[2, 0] = xz
    out[1, 2] = out[2, 1] = yz
    return out
