"""Relative velocity by differential GNSS, along inertial axes."""

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float, float, float]:
    """v - v_c."""
    return deputy[3] - chief[3], deputy[4] - chief[4], deputy[5] - chief[5]


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """The identity."""
    jacobian[0, 3] = jacobian[1, 4] = jacobian[2, 5] = 1.0


GNSS_VELOCITY = Sensor(
    name="gnss_velocity",
    title="GNSS relative velocity",
    unit="m/s",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.001, 0.001, 0.001),
    sigma_range=(1e-9, 1e3),
    reading_unit=DisplayUnit("m/s"),
    innovation_unit=DisplayUnit("mm/s", 1e3),
    on=False,
    labels=("X", "Y", "Z"),
)
"""With the noise of a carrier-phase solution in real time; a coarse one has about a centimetre per second."""
