"""Bearing: line of sight from the chief to the deputy in the chief's Hill frame, as a camera has it."""

from math import atan2, degrees, sqrt

from formation_gnc.sensors.sensor import DisplayUnit, Sensor, State
from formation_gnc.types import Matrix, Vector


def measure(deputy: State, chief: State) -> tuple[float, float]:
    """Azimuth in the orbit plane, from the flight direction outwards, and elevation, towards the orbit normal.

    A camera on the deputy sees the chief in the opposite direction, with the same information.
    """
    rx, ry, rz, vx, vy, vz = chief[0], chief[1], chief[2], chief[3], chief[4], chief[5]
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    radius, momentum = sqrt(rx * rx + ry * ry + rz * rz), sqrt(hx * hx + hy * hy + hz * hz)
    dx, dy, dz = deputy[0] - rx, deputy[1] - ry, deputy[2] - rz
    out = (dx * rx + dy * ry + dz * rz) / radius
    across = (dx * hx + dy * hy + dz * hz) / momentum
    ahead = dx * (hy * rz - hz * ry) + dy * (hz * rx - hx * rz) + dz * (hx * ry - hy * rx)
    ahead = ahead / (radius * momentum)
    return atan2(out, ahead), atan2(across, sqrt(out * out + ahead * ahead))


def differentiate(deputy: Vector, chief: Vector, jacobian: Matrix) -> None:
    """Across the line of sight over the distance; not finite at the chief, and above and below it along the normal."""
    rx, ry, rz, vx, vy, vz = chief[0], chief[1], chief[2], chief[3], chief[4], chief[5]
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    radius, momentum = sqrt(rx * rx + ry * ry + rz * rz), sqrt(hx * hx + hy * hy + hz * hz)
    rx, ry, rz = rx / radius, ry / radius, rz / radius
    hx, hy, hz = hx / momentum, hy / momentum, hz / momentum
    ax, ay, az = hy * rz - hz * ry, hz * rx - hx * rz, hx * ry - hy * rx
    dx, dy, dz = deputy[0] - chief[0], deputy[1] - chief[1], deputy[2] - chief[2]
    out, ahead, across = (
        dx * rx + dy * ry + dz * rz,
        dx * ax + dy * ay + dz * az,
        dx * hx + dy * hy + dz * hz,
    )
    plane = out * out + ahead * ahead
    root, square = sqrt(plane), plane + across * across
    jacobian[0, 0] = (ahead * rx - out * ax) / plane
    jacobian[0, 1] = (ahead * ry - out * ay) / plane
    jacobian[0, 2] = (ahead * rz - out * az) / plane
    jacobian[1, 0] = (root * hx - across * (out * rx + ahead * ax) / root) / square
    jacobian[1, 1] = (root * hy - across * (out * ry + ahead * ay) / root) / square
    jacobian[1, 2] = (root * hz - across * (out * rz + ahead * az) / root) / square


BEARING = Sensor(
    name="bearing",
    title="bearing",
    unit="rad",
    measure=measure,
    differentiate=differentiate,
    sigma=(1e-4, 1e-4),
    sigma_range=(1e-9, 10.0),
    reading_unit=DisplayUnit("deg", degrees(1.0)),
    innovation_unit=DisplayUnit("µrad", 1e6),
    on=False,
    labels=("azimuth", "elevation"),
    angles=(0,),
)
