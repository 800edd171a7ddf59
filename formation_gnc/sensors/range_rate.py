"""Range rate: time derivative of the distance from the Earth's centre (Neokleous 3.12)."""

from math import sqrt

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """r . v / |r|."""
    x, y, z, vx, vy, vz = deputy[0], deputy[1], deputy[2], deputy[3], deputy[4], deputy[5]
    return ((x * vx + y * vy + z * vz) / sqrt(x * x + y * y + z * z),)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Velocity across the radius over r, and the radius."""
    x, y, z, vx, vy, vz = deputy[0], deputy[1], deputy[2], deputy[3], deputy[4], deputy[5]
    r = sqrt(x * x + y * y + z * z)
    range_rate = (x * vx + y * vy + z * vz) / r
    jacobian[0, 0] = (vx - range_rate * x / r) / r
    jacobian[0, 1] = (vy - range_rate * y / r) / r
    jacobian[0, 2] = (vz - range_rate * z / r) / r
    jacobian[0, 3], jacobian[0, 4], jacobian[0, 5] = x / r, y / r, z / r


RANGE_RATE = Sensor(
    name="range_rate",
    title="range rate",
    unit="m/s",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.01,),
    sigma_range=(1e-9, 1e6),
    reading_unit=DisplayUnit("m/s"),
    innovation_unit=DisplayUnit("m/s"),
)
