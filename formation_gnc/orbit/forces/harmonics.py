"""The Earth's gravity field in spherical harmonics, after Cunningham (Montenbruck and Gill, section 3.2)."""

from math import factorial, sqrt

import numpy as np

from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE, NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.jit import inline

_SIZE = MAXIMUM_DEGREE + 2

# Factors of the recursion over the degree, and coefficients without normalisation.
_AHEAD, _BEHIND = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
for _n in range(_SIZE):
    for _m in range(_n):
        _AHEAD[_n, _m] = (2 * _n - 1) / (_n - _m)
        _BEHIND[_n, _m] = (_n + _m - 1) / (_n - _m)
_C, _S = NORMALISED_C.copy(), NORMALISED_S.copy()
for _n in range(MAXIMUM_DEGREE + 1):
    for _m in range(_n + 1):
        _scale = sqrt((2 - (_m == 0)) * (2 * _n + 1) * factorial(_n - _m) / factorial(_n + _m))
        _C[_n, _m] *= _scale
        _S[_n, _m] *= _scale


@inline
def acceleration(
    degree: int, cos_turn: float, sin_turn: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Acceleration by the whole field, central term included, up to a degree and order, m/s^2.

    The arguments are inertial, and so is the result; the turn is the Earth's rotation angle.
    """
    x, y = cos_turn * x + sin_turn * y, cos_turn * y - sin_turn * x
    r2 = x * x + y * y + z * z
    px, py, pz = x * EARTH_RADIUS / r2, y * EARTH_RADIUS / r2, z * EARTH_RADIUS / r2
    square = EARTH_RADIUS * EARTH_RADIUS / r2
    v, w = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
    v[0, 0] = EARTH_RADIUS / sqrt(r2)
    for m in range(degree + 2):
        if m > 0:
            v[m, m] = (2 * m - 1) * (px * v[m - 1, m - 1] - py * w[m - 1, m - 1])
            w[m, m] = (2 * m - 1) * (px * w[m - 1, m - 1] + py * v[m - 1, m - 1])
        if m <= degree:
            v[m + 1, m] = _AHEAD[m + 1, m] * pz * v[m, m]
            w[m + 1, m] = _AHEAD[m + 1, m] * pz * w[m, m]
        for n in range(m + 2, degree + 2):
            v[n, m] = _AHEAD[n, m] * pz * v[n - 1, m] - _BEHIND[n, m] * square * v[n - 2, m]
            w[n, m] = _AHEAD[n, m] * pz * w[n - 1, m] - _BEHIND[n, m] * square * w[n - 2, m]
    ax, ay, az = 0.0, 0.0, 0.0
    for n in range(degree, -1, -1):  # the small terms first
        for m in range(n, 0, -1):
            c, s = 0.5 * _C[n, m], 0.5 * _S[n, m]
            rise = (n - m + 2) * (n - m + 1)
            ax += (
                rise * (c * v[n + 1, m - 1] + s * w[n + 1, m - 1]) - c * v[n + 1, m + 1] - s * w[n + 1, m + 1]
            )
            ay += (
                rise * (s * v[n + 1, m - 1] - c * w[n + 1, m - 1]) - c * w[n + 1, m + 1] + s * v[n + 1, m + 1]
            )
            az -= 2.0 * (n - m + 1) * (c * v[n + 1, m] + s * w[n + 1, m])
        ax -= _C[n, 0] * v[n + 1, 1]
        ay -= _C[n, 0] * w[n + 1, 1]
        az -= (n + 1) * _C[n, 0] * v[n + 1, 0]
    scale = MU / (EARTH_RADIUS * EARTH_RADIUS)
    return scale * (cos_turn * ax - sin_turn * ay), scale * (sin_turn * ax + cos_turn * ay), scale * az
