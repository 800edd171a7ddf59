"""Solar radiation pressure on a sphere, with the Earth's shadow."""

from math import acos, asin, pi, sqrt

from formation_gnc.orbit import sky
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.forces.force import Floats, Force, Surroundings, Vector3
from formation_gnc.orbit.jit import inline
from formation_gnc.orbit.sky import ASTRONOMICAL_UNIT
from formation_gnc.parameters import parameter

SOLAR_PRESSURE = 1361.0 / 299792458.0
"""Pressure of sunlight on an absorbing surface at one astronomical unit, N/m^2 (irradiance of IAU 2015)."""

SUN_RADIUS = 695.7e6
"""Radius of the Sun, m (IAU 2015)."""


@inline
def illumination(
    sx: float,
    sy: float,
    sz: float,
    x: float,
    y: float,
    z: float,
    earth_radius: float = EARTH_RADIUS,
    sun_radius: float = SUN_RADIUS,
) -> float:
    """Visible fraction of the Sun's disc: 0 in umbra, 1 in sunlight (Montenbruck and Gill 3.4.2).

    Sun at (sx, sy, sz) and satellite at (x, y, z), geocentric, m. Conical shadow of a spherical Earth.
    """
    dx, dy, dz = sx - x, sy - y, sz - z
    distance = sqrt(dx * dx + dy * dy + dz * dz)
    r = sqrt(x * x + y * y + z * z)
    if r <= earth_radius:
        return 0.0
    sun = asin(sun_radius / distance)  # apparent radii and separation of the two discs
    earth = asin(earth_radius / r)
    apart = acos(max(-1.0, min(1.0, -(x * dx + y * dy + z * dz) / (r * distance))))
    if apart >= sun + earth:
        return 1.0
    if apart <= earth - sun:
        return 0.0
    if apart <= sun - earth:
        return 1.0 - (earth / sun) ** 2
    along = (apart * apart + sun * sun - earth * earth) / (2.0 * apart)
    across = sqrt(max(0.0, sun * sun - along * along))
    covered = (
        sun * sun * acos(max(-1.0, min(1.0, along / sun)))
        + earth * earth * acos(max(-1.0, min(1.0, (apart - along) / earth)))
        - apart * across
    )
    return 1.0 - covered / (pi * sun * sun)


@inline
def acceleration(
    area_to_mass: float,
    sx: float,
    sy: float,
    sz: float,
    x: float,
    y: float,
    z: float,
    earth_radius: float = EARTH_RADIUS,
    sun_radius: float = SUN_RADIUS,
    solar_pressure: float = SOLAR_PRESSURE,
) -> Vector3:
    """Acceleration by sunlight, m/s^2; `area_to_mass` is reflectivity times area over mass, m^2/kg."""
    light = illumination(sx, sy, sz, x, y, z, earth_radius, sun_radius)
    dx, dy, dz = x - sx, y - sy, z - sz
    square = dx * dx + dy * dy + dz * dz
    push = light * solar_pressure * area_to_mass * ASTRONOMICAL_UNIT**2 / (square * sqrt(square))
    return push * dx, push * dy, push * dz


@inline
def _on_satellite(settings: Floats, coefficient: float, around: Surroundings, state: Floats) -> Vector3:
    x, y, z = state[:3]
    sun_x, sun_y, sun_z = around.sun_x, around.sun_y, around.sun_z
    earth, sun = around.radius, around.sun_radius
    return acceleration(coefficient, sun_x, sun_y, sun_z, x, y, z, earth, sun, around.solar_pressure)


RADIATION_PRESSURE = Force(
    {"radiation_pressure": parameter(False, doc="Solar radiation pressure, less the Earth's shadow")},
    _on_satellite,
    sky.SUN,
    lambda body: body.area * body.reflectivity,
)
