"""Toy sensor: position relative to the chief along inertial axes, a reading of three values."""

from formation_gnc.sensors.sensor import Axis, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float, float, float]:
    return deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    for i in range(3):
        jacobian[i, i] = 1.0


RELATIVE_POSITION = Sensor(
    name="relative_position",
    title="relative position",
    unit="m",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.5, 0.5, 1.0),
    sigma_range=(1e-3, 1e6),
    readings=Axis("m"),
    innovations=Axis("cm", 100.0),
    on=False,
    labels=("X", "Y", "Z"),
)
