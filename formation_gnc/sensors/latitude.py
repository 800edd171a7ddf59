"""Latitude: geocentric latitude (Neokleous 3.12)."""

from math import atan2, degrees, sqrt

from formation_gnc.sensors.norm import norm
from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """Angle above the equatorial plane."""
    return (atan2(deputy[2], norm(deputy[0], deputy[1])),)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Northwards over r; not finite above a pole."""
    x, y, z = deputy[0], deputy[1], deputy[2]
    equatorial = x * x + y * y
    square, root = equatorial + z * z, sqrt(equatorial)
    jacobian[0, 0] = -z * x / (square * root)
    jacobian[0, 1] = -z * y / (square * root)
    jacobian[0, 2] = root / square


LATITUDE = Sensor(
    name="latitude",
    title="latitude",
    unit="rad",
    measure=measure,
    differentiate=differentiate,
    sigma=(1e-6,),
    sigma_range=(1e-12, 10.0),
    reading_unit=DisplayUnit("deg", degrees(1.0)),
    innovation_unit=DisplayUnit("µrad", 1e6),
)
