"""The Earth's gravity field in spherical harmonics, after Cunningham (Montenbruck and Gill, section 3.2).

With V_nm and W_nm the solid harmonics of a point, the potential is ``mu / R sum (C_nm V_nm + S_nm W_nm)``.
Derivatives of solid harmonics are solid harmonics one degree up, so every component of the acceleration is such a
sum too, with coefficients that are computed once. There is no singularity, at the poles either.
"""

from math import factorial, sqrt

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE, NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.jit import inline

Array = NDArray[np.float64]

_SIZE = MAXIMUM_DEGREE + 2

# Factors of the recursion over the degree.
_AHEAD, _BEHIND = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
for _n in range(_SIZE):
    for _m in range(_n):
        _AHEAD[_n, _m] = (2 * _n - 1) / (_n - _m)
        _BEHIND[_n, _m] = (_n + _m - 1) / (_n - _m)


def derivatives(cosines: Array, sines: Array) -> Array:
    """Coefficients of the acceleration by a field (Montenbruck and Gill 3.33), computed once.

    Args:
        cosines: fully normalised C_nm by degree and order, (N + 1, N + 1), N at most `MAXIMUM_DEGREE`.
        sines: fully normalised S_nm.

    Returns:
        (6, MAXIMUM_DEGREE + 2, MAXIMUM_DEGREE + 2): those of V and W of degree n + 1 in the x, y and z components
        that degree n makes.
    """
    out = np.zeros((6, _SIZE, _SIZE))
    xv, xw, yv, yw, zv, zw = out
    for n in range(len(cosines)):
        for m in range(n + 1):
            scale = sqrt((2 - (m == 0)) * (2 * n + 1) * factorial(n - m) / factorial(n + m))
            c, s = scale * cosines[n, m], scale * sines[n, m]
            half = 1.0 if m == 0 else 0.5
            xv[n, m + 1] -= half * c
            xw[n, m + 1] -= half * s
            yv[n, m + 1] += half * s
            yw[n, m + 1] -= half * c
            if m > 0:
                rise = 0.5 * (n - m + 2) * (n - m + 1)
                xv[n, m - 1] += rise * c
                xw[n, m - 1] += rise * s
                yv[n, m - 1] += rise * s
                yw[n, m - 1] -= rise * c
            zv[n, m] -= (n - m + 1) * c
            zw[n, m] -= (n - m + 1) * s
    return out


EGM2008 = derivatives(NORMALISED_C, NORMALISED_S)
"""`derivatives` of EGM2008."""


@inline
def acceleration(
    degree: int,
    cos_turn: float,
    sin_turn: float,
    x: float,
    y: float,
    z: float,
    mu: float = MU,
    radius: float = EARTH_RADIUS,
    field: Array = EGM2008,
) -> tuple[float, float, float]:
    """Inertial acceleration by the field up to a degree and order, central term included, m/s^2.

    Position is inertial, m; `cos_turn` and `sin_turn` are of the Earth's rotation angle, `field` are `derivatives`.
    """
    x, y = cos_turn * x + sin_turn * y, cos_turn * y - sin_turn * x
    r2 = x * x + y * y + z * z
    px, py, pz = x * radius / r2, y * radius / r2, z * radius / r2
    square = radius * radius / r2
    v, w = np.empty((_SIZE, _SIZE)), np.empty((_SIZE, _SIZE))  # filled up to degree + 1, m <= n
    v[0, 0], w[0, 0] = radius / sqrt(r2), 0.0
    for n in range(1, degree + 2):
        before = n - 1
        for m in range(n - 1):  # orders are independent: this loop is vectorised
            v[n, m] = _AHEAD[n, m] * pz * v[before, m] - _BEHIND[n, m] * square * v[n - 2, m]
            w[n, m] = _AHEAD[n, m] * pz * w[before, m] - _BEHIND[n, m] * square * w[n - 2, m]
        v[n, before] = _AHEAD[n, before] * pz * v[before, before]
        w[n, before] = _AHEAD[n, before] * pz * w[before, before]
        v[n, n] = (2 * n - 1) * (px * v[before, before] - py * w[before, before])
        w[n, n] = (2 * n - 1) * (px * w[before, before] + py * v[before, before])
    ax, ay, az = 0.0, 0.0, 0.0
    for n in range(degree, -1, -1):  # small terms first
        for m in range(n + 2):
            ax += field[0, n, m] * v[n + 1, m] + field[1, n, m] * w[n + 1, m]
            ay += field[2, n, m] * v[n + 1, m] + field[3, n, m] * w[n + 1, m]
            az += field[4, n, m] * v[n + 1, m] + field[5, n, m] * w[n + 1, m]
    scale = mu / (radius * radius)
    return scale * (cos_turn * ax - sin_turn * ay), scale * (sin_turn * ax + cos_turn * ay), scale * az
