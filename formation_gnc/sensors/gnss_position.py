"""Relative position by differential GNSS: from the chief to the deputy, along inertial axes."""

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float, float, float]:
    """r - r_c."""
    return deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """The identity."""
    jacobian[0, 0] = jacobian[1, 1] = jacobian[2, 2] = 1.0


GNSS_POSITION = Sensor(
    name="gnss_position",
    title="GNSS relative position",
    unit="m",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.1, 0.1, 0.1),
    sigma_range=(1e-6, 1e6),
    reading_unit=DisplayUnit("m"),
    innovation_unit=DisplayUnit("m"),
    on=False,
    labels=("X", "Y", "Z"),
)
"""With the noise of a carrier-phase solution in real time; a coarse one, by code alone, has about a metre."""
