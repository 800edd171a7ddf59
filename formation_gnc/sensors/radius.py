"""Radius: distance from the Earth's centre (Neokleous 3.12)."""

from math import sqrt

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """R = |r|."""
    x, y, z = deputy[0], deputy[1], deputy[2]
    return (sqrt(x * x + y * y + z * z),)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Along the radius."""
    x, y, z = deputy[0], deputy[1], deputy[2]
    r = sqrt(x * x + y * y + z * z)
    jacobian[0, 0], jacobian[0, 1], jacobian[0, 2] = x / r, y / r, z / r


RADIUS = Sensor(
    name="radius",
    title="radius",
    unit="m",
    measure=measure,
    differentiate=differentiate,
    sigma=(5.0,),
    sigma_range=(1e-6, 1e9),
    reading_unit=DisplayUnit("km", 1e-3),
    innovation_unit=DisplayUnit("m"),
)
