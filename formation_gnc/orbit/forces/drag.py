"""Drag in a co-rotating atmosphere, exponential in each band of altitude."""

from math import exp, sqrt

import numpy as np

from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE
from formation_gnc.orbit.forces.force import Floats, Force, Vector3
from formation_gnc.orbit.jit import inline
from formation_gnc.parameters import parameter

FLATTENING = 1.0 / 298.257223563
"""Flattening of the reference surface of altitude (WGS 84)."""

# Base altitude, km; density there, kg/m^3; scale height, km. Vallado, Fundamentals of Astrodynamics, 8-4:
# US Standard Atmosphere to 25 km, CIRA-72 to 500 km, CIRA-72 with an exospheric temperature of 1000 K above.
_BANDS = np.array(
    [
        (0.0, 1.225, 7.249),
        (25.0, 3.899e-2, 6.349),
        (30.0, 1.774e-2, 6.682),
        (40.0, 3.972e-3, 7.554),
        (50.0, 1.057e-3, 8.382),
        (60.0, 3.206e-4, 7.714),
        (70.0, 8.770e-5, 6.549),
        (80.0, 1.905e-5, 5.799),
        (90.0, 3.396e-6, 5.382),
        (100.0, 5.297e-7, 5.877),
        (110.0, 9.661e-8, 7.263),
        (120.0, 2.438e-8, 9.473),
        (130.0, 8.484e-9, 12.636),
        (140.0, 3.845e-9, 16.149),
        (150.0, 2.070e-9, 22.523),
        (180.0, 5.464e-10, 29.740),
        (200.0, 2.789e-10, 37.105),
        (250.0, 7.248e-11, 45.546),
        (300.0, 2.418e-11, 53.628),
        (350.0, 9.518e-12, 53.298),
        (400.0, 3.725e-12, 58.515),
        (450.0, 1.585e-12, 60.828),
        (500.0, 6.967e-13, 63.822),
        (600.0, 1.454e-13, 71.835),
        (700.0, 3.614e-14, 88.667),
        (800.0, 1.170e-14, 124.64),
        (900.0, 5.245e-15, 181.05),
        (1000.0, 3.019e-15, 268.00),
    ]
)
_BASE, _DENSITY, _SCALE = _BANDS[:, 0] * 1e3, _BANDS[:, 1].copy(), _BANDS[:, 2] * 1e3


@inline
def density(x: float, y: float, z: float) -> float:
    """Density of the atmosphere, kg/m^3, at an inertial position, m.

    Altitude is along the radius from the ellipsoid, within 100 m of the geodetic altitude in LEO.
    """
    r = sqrt(x * x + y * y + z * z)
    sine = z / r
    altitude = r - EARTH_RADIUS * (1.0 - FLATTENING * sine * sine)
    band = 0
    while band + 1 < len(_BASE) and altitude >= _BASE[band + 1]:
        band += 1
    result: float = _DENSITY[band] * exp((_BASE[band] - altitude) / _SCALE[band])
    return result


@inline
def acceleration(area_to_mass: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> Vector3:
    """Acceleration by drag, m/s^2; `area_to_mass` is drag coefficient times area over mass, m^2/kg."""
    ux, uy, uz = vx + EARTH_ROTATION_RATE * y, vy - EARTH_ROTATION_RATE * x, vz
    brake = -0.5 * density(x, y, z) * area_to_mass * sqrt(ux * ux + uy * uy + uz * uz)
    return brake * ux, brake * uy, brake * uz


@inline
def _on_satellite(settings: Floats, coefficient: float, ephemerides: Floats, state: Floats) -> Vector3:
    return acceleration(coefficient, *state)


DRAG = Force(
    {"drag": parameter(False, doc="Drag in an exponential atmosphere that turns with the Earth")},
    _on_satellite,
    coefficient=lambda body: body.area * body.drag_coefficient,
)
