"""Chief range rate: time derivative of the distance to the chief."""

from formation_gnc.sensors.norm import norm
from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float]:
    """(r - r_c) . (v - v_c) / |r - r_c|; zero at the chief."""
    dx, dy, dz = deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]
    ux, uy, uz = deputy[3] - chief[3], deputy[4] - chief[4], deputy[5] - chief[5]
    distance = norm(dx, dy, dz)
    return ((dx * ux + dy * uy + dz * uz) / distance if distance > 0.0 else 0.0,)


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Velocity across the line of sight over the distance, and the line of sight; not finite at the chief."""
    dx, dy, dz = deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]
    ux, uy, uz = deputy[3] - chief[3], deputy[4] - chief[4], deputy[5] - chief[5]
    distance = norm(dx, dy, dz)
    dx, dy, dz = dx / distance, dy / distance, dz / distance
    rate = dx * ux + dy * uy + dz * uz
    jacobian[0, 0], jacobian[0, 1] = (ux - rate * dx) / distance, (uy - rate * dy) / distance
    jacobian[0, 2] = (uz - rate * dz) / distance
    jacobian[0, 3], jacobian[0, 4], jacobian[0, 5] = dx, dy, dz


CHIEF_RANGE_RATE = Sensor(
    name="chief_range_rate",
    title="chief range rate",
    unit="m/s",
    measure=measure,
    differentiate=differentiate,
    sigma=(0.001,),
    sigma_range=(1e-9, 1e6),
    reading_unit=DisplayUnit("m/s"),
    innovation_unit=DisplayUnit("mm/s", 1e3),
    on=False,
)
