"""The Earth's gravity field in spherical harmonics, after Cunningham (Montenbruck and Gill, section 3.2).

With V_nm and W_nm the solid harmonics of a point, the potential is ``mu / R sum (C_nm V_nm + S_nm W_nm)``.
Derivatives of solid harmonics are solid harmonics one degree up, so every component of the acceleration is such a
sum too, with coefficients that are computed once, at import. There is no singularity, at the poles either.
"""

from math import factorial, sqrt

import numpy as np

from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE, NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.jit import inline

_SIZE = MAXIMUM_DEGREE + 2

# Factors of the recursion over the degree.
_AHEAD, _BEHIND = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
for _n in range(_SIZE):
    for _m in range(_n):
        _AHEAD[_n, _m] = (2 * _n - 1) / (_n - _m)
        _BEHIND[_n, _m] = (_n + _m - 1) / (_n - _m)

# Coefficients of V and W of degree n + 1 in the acceleration that degree n makes (Montenbruck and Gill 3.33).
_XV, _XW, _YV, _YW, _ZV, _ZW = np.zeros((6, _SIZE, _SIZE))
for _n in range(MAXIMUM_DEGREE + 1):
    for _m in range(_n + 1):
        _scale = sqrt((2 - (_m == 0)) * (2 * _n + 1) * factorial(_n - _m) / factorial(_n + _m))
        _c, _s = _scale * NORMALISED_C[_n, _m], _scale * NORMALISED_S[_n, _m]
        _half = 1.0 if _m == 0 else 0.5
        _XV[_n, _m + 1] -= _half * _c
        _XW[_n, _m + 1] -= _half * _s
        _YV[_n, _m + 1] += _half * _s
        _YW[_n, _m + 1] -= _half * _c
        if _m > 0:
            _rise = 0.5 * (_n - _m + 2) * (_n - _m + 1)
            _XV[_n, _m - 1] += _rise * _c
            _XW[_n, _m - 1] += _rise * _s
            _YV[_n, _m - 1] += _rise * _s
            _YW[_n, _m - 1] -= _rise * _c
        _ZV[_n, _m] -= (_n - _m + 1) * _c
        _ZW[_n, _m] -= (_n - _m + 1) * _s


@inline
def acceleration(
    degree: int, cos_turn: float, sin_turn: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Inertial acceleration by the field up to a degree and order, central term included, m/s^2.

    Position is inertial, m; `cos_turn` and `sin_turn` are of the Earth's rotation angle.
    """
    x, y = cos_turn * x + sin_turn * y, cos_turn * y - sin_turn * x
    r2 = x * x + y * y + z * z
    px, py, pz = x * EARTH_RADIUS / r2, y * EARTH_RADIUS / r2, z * EARTH_RADIUS / r2
    square = EARTH_RADIUS * EARTH_RADIUS / r2
    v, w = np.empty((_SIZE, _SIZE)), np.empty((_SIZE, _SIZE))  # filled up to degree + 1, m <= n
    v[0, 0], w[0, 0] = EARTH_RADIUS / sqrt(r2), 0.0
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
            ax += _XV[n, m] * v[n + 1, m] + _XW[n, m] * w[n + 1, m]
            ay += _YV[n, m] * v[n + 1, m] + _YW[n, m] * w[n + 1, m]
            az += _ZV[n, m] * v[n + 1, m] + _ZW[n, m] * w[n + 1, m]
    scale = MU / (EARTH_RADIUS * EARTH_RADIUS)
    return scale * (cos_turn * ax - sin_turn * ay), scale * (sin_turn * ax + cos_turn * ay), scale * az
