"""What the sensors should read, and how that changes with the state."""

from math import atan2, sqrt

import numpy as np

from formation_gnc.interface import Matrix, Sensor, Vector


def predicted_readings(sensors: list[int], state: Vector) -> tuple[Vector, Matrix]:
    """Readings and their Jacobian for a satellite with an inertial state.

    The full nonlinear radius, range rate (rate of change of the radius) and geocentric latitude (Neokleous 3.2, without the
    linearisation of its pseudo-measurements 3.13).

    Args:
        sensors: the k sensors that read, constants of :class:`Sensor`.
        state: (6,) inertial position and velocity, m and m/s.

    Returns:
        (k,) readings in the unit of each sensor, and (k, 6) their derivatives with respect to the inertial state.
    """
    x, y, z, vx, vy, vz = state.tolist()
    r = sqrt(x * x + y * y + z * z)
    range_rate = (x * vx + y * vy + z * vz) / r
    readings = np.empty(len(sensors))
    jacobian = np.zeros((len(sensors), 6))
    for row, sensor in enumerate(sensors):
        if sensor == Sensor.RADIUS:
            readings[row] = r
            jacobian[row, :3] = x / r, y / r, z / r
        elif sensor == Sensor.RANGE_RATE:
            readings[row] = range_rate
            jacobian[row, :3] = (
                (vx - range_rate * x / r) / r,
                (vy - range_rate * y / r) / r,
                (vz - range_rate * z / r) / r,
            )
            jacobian[row, 3:] = x / r, y / r, z / r
        elif sensor == Sensor.LATITUDE:
            equatorial = sqrt(x * x + y * y)
            readings[row] = atan2(z, equatorial)
            jacobian[row, :3] = (
                -z * x / (r * r * equatorial),
                -z * y / (r * r * equatorial),
                equatorial / (r * r),
            )
        else:
            raise ValueError(f"sensor {sensor} has no measurement model")
    return readings, jacobian
