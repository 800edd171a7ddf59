"""Gravity of the point mass with zonal harmonics J2 to J6."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, MU, ZONALS
from formation_gnc.orbit.gravity import OBLATENESS, oblate_acceleration
from formation_gnc.orbit.jit import inline

BY_DEGREE = np.array([0.0, 0.0, *ZONALS])
"""J_n by degree."""


@inline
def acceleration(
    degree: int,
    x: float,
    y: float,
    z: float,
    mu: float = MU,
    radius: float = EARTH_RADIUS,
    oblateness: float = OBLATENESS,
    zonals: NDArray[np.float64] = BY_DEGREE,
) -> tuple[float, float, float]:
    """Acceleration by the point mass and the zonal harmonics up to a degree (below 2: none), m/s^2.

    With s = z/r and P_n Legendre's polynomials, degree n adds
    ``mu J_n R^n / r^(n+2) [P'_(n+1)(s) r_hat - P'_n(s) z_hat]``: the gradient of its potential. `oblateness`
    is 3/2 J2 mu R^2.
    """
    if degree == 2:
        return oblate_acceleration(x, y, z, mu, oblateness)
    r = sqrt(x * x + y * y + z * z)
    s = z / r
    radial, polar = -1.0, 0.0
    before, here = 1.0, s  # P_(n-1) and P_n, from n = 1
    slope_before, slope = 0.0, 1.0  # their derivatives
    ratio = radius / r
    power = ratio
    for n in range(1, degree + 1):
        following = ((2 * n + 1) * s * here - n * before) / (n + 1)
        slope_following = slope_before + (2 * n + 1) * here
        if n > 1:
            radial += zonals[n] * power * slope_following
            polar -= zonals[n] * power * slope
        before, here = here, following
        slope_before, slope = slope, slope_following
        power *= ratio
    scale = mu / (r * r)
    return scale * radial * x / r, scale * radial * y / r, scale * (radial * s + polar)
