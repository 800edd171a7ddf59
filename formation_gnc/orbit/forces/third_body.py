"""Third-body attraction of Sun and Moon, as point masses, relative to that of the Earth."""

from formation_gnc.orbit import sky
from formation_gnc.orbit.forces.force import Floats, Force, Surroundings, Vector3
from formation_gnc.orbit.jit import inline
from formation_gnc.parameters import parameter

MU_SUN = 1.32712440041e20
"""Gravitational parameter of the Sun, m^3/s^2 (JPL DE440)."""

MU_MOON = 4.902800118e12
"""Gravitational parameter of the Moon, m^3/s^2 (JPL DE440)."""


@inline
def acceleration(mu: float, bx: float, by: float, bz: float, x: float, y: float, z: float) -> Vector3:
    """Acceleration at (x, y, z) by a body at (bx, by, bz), geocentric, m/s^2 (Montenbruck and Gill 3.37)."""
    dx, dy, dz = bx - x, by - y, bz - z
    near = mu / (dx * dx + dy * dy + dz * dz) ** 1.5
    far = mu / (bx * bx + by * by + bz * bz) ** 1.5
    return near * dx - far * bx, near * dy - far * by, near * dz - far * bz


@inline
def _of_sun(settings: Floats, coefficient: float, around: Surroundings, state: Floats) -> Vector3:
    return acceleration(around.mu_sun, around.sun_x, around.sun_y, around.sun_z, *state[:3])


@inline
def _of_moon(settings: Floats, coefficient: float, around: Surroundings, state: Floats) -> Vector3:
    return acceleration(around.mu_moon, around.moon_x, around.moon_y, around.moon_z, *state[:3])


SUN_ATTRACTION = Force({"sun": parameter(False, doc="Attraction of the Sun")}, _of_sun, sky.SUN)
MOON_ATTRACTION = Force({"moon": parameter(False, doc="Attraction of the Moon")}, _of_moon, sky.MOON)
