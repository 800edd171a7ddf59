"""Right ascension: inertial longitude."""

from math import atan2, degrees

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """Angle of the equatorial projection from the x axis, within half a turn."""
    return (atan2(deputy[1], deputy[0]),)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Eastwards over the distance from the Earth's axis; not finite above a pole."""
    x, y = deputy[0], deputy[1]
    equatorial = x * x + y * y
    jacobian[0, 0], jacobian[0, 1] = -y / equatorial, x / equatorial


RIGHT_ASCENSION = Sensor(
    name="right_ascension",
    title="right ascension",
    unit="rad",
    measure=measure,
    differentiate=differentiate,
    sigma=(1e-6,),
    sigma_range=(1e-12, 10.0),
    reading_unit=DisplayUnit("deg", degrees(1.0)),
    innovation_unit=DisplayUnit("µrad", 1e6),
    on=False,
    angles=(0,),
)
