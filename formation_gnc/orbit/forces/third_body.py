"""Sun and Moon as point masses, less what they do to the Earth itself."""

from formation_gnc.orbit.jit import inline

MU_SUN = 1.32712440041e20
"""Gravitational parameter of the Sun, m^3/s^2 (JPL DE440)."""

MU_MOON = 4.902800118e12
"""Gravitational parameter of the Moon, m^3/s^2 (JPL DE440)."""


@inline
def acceleration(
    mu: float, bx: float, by: float, bz: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Acceleration at (x, y, z) by a body at (bx, by, bz), geocentric, m/s^2 (Montenbruck and Gill 3.37)."""
    dx, dy, dz = bx - x, by - y, bz - z
    near = mu / (dx * dx + dy * dy + dz * dz) ** 1.5
    far = mu / (bx * bx + by * by + bz * bz) ** 1.5
    return near * dx - far * bx, near * dy - far * by, near * dz - far * bz
