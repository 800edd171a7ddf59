"""Chief range: distance to the chief."""

from formation_gnc.sensors.norm import norm
from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """|r - r_c|."""
    return (norm(deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]),)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Away from the chief; not finite at it."""
    dx, dy, dz = deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]
    distance = norm(dx, dy, dz)
    jacobian[0, 0], jacobian[0, 1], jacobian[0, 2] = dx / distance, dy / distance, dz / distance


CHIEF_RANGE = Sensor(
    name="chief_range",
    title="chief range",
    unit="m",
    measure=measure,
    differentiate=differentiate,
    sigma=(1.0,),
    sigma_range=(1e-6, 1e9),
    reading_unit=DisplayUnit("m"),
    innovation_unit=DisplayUnit("m"),
    on=False,
)
