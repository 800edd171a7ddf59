"""Earth's gravity and figure, from one published model: EGM2008 (Pavlis et al. 2012), tide-free.

The zonal coefficients are un-normalised, ``J_n = -sqrt(2 n + 1) C_n0``, and valid with this ``MU`` and
``EARTH_RADIUS`` only: coefficients of another model are no drop-in replacement.
"""

from math import sqrt

MU = 3.986004415e14
"""Gravitational parameter of the Earth, m^3/s^2."""

EARTH_RADIUS = 6378136.3
"""Reference (equatorial) radius of the gravity model, m."""

NORMALISED_ZONALS = {
    2: -0.484165143790815e-03,
    3: 0.957161207093473e-06,
    4: 0.539965866638991e-06,
    5: 0.686702913736681e-07,
    6: -0.149953927978527e-06,
}
"""Fully normalised C_n0 by degree n, as published."""

J2, J3, J4, J5, J6 = (-sqrt(2 * n + 1) * c for n, c in NORMALISED_ZONALS.items())

EARTH_ROTATION_RATE = 7.292115e-5
"""Rotation rate of the Earth in inertial space, rad/s (IERS 2010 conventions, nominal)."""

ZONALS = (J2, J3, J4, J5, J6)
"""Un-normalised zonal coefficients from degree 2."""

FLATTENING = 1.0 / 298.257223563
"""Flattening of the reference ellipsoid (WGS 84)."""
