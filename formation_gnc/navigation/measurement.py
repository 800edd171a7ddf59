"""What the sensors should read, how that changes with the state, and readings that come late."""

from collections import deque
from dataclasses import dataclass
from math import pi

import numpy as np

from formation_gnc.navigation import kernels
from formation_gnc.navigation.process import Interval, substeps
from formation_gnc.orbit.frames import hill_rotation, hill_transform_inverse, inertial_from_relative
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.records import Sensor
from formation_gnc.types import Matrix, Vector

NAMES = {sensor: sensor.name.lower() for sensor in Sensor}
"""Sensors as parameters and events call them."""

_RIGHT_ASCENSION = int(Sensor.RIGHT_ASCENSION)

_AT_REST = np.zeros(3)


class StateHistory:
    """The legs last flown, so that the deputy can be followed back to when a late reading was taken."""

    def __init__(self, longest: int, earlier: "StateHistory | None" = None) -> None:
        """Remember at most so many legs, starting with those of an earlier track."""
        self._legs: deque[Interval] = deque(earlier._legs if earlier else (), maxlen=longest)

    def add(self, leg: Interval) -> None:
        """The leg that ends now."""
        self._legs.append(leg)

    def back(self, deputy: Vector, age: float) -> tuple[Vector, Matrix]:
        """Where the deputy was.

        Args:
            deputy: inertial state now, (6,).
            age: how long ago, s.

        Returns:
            Inertial state then, (6,), and its derivative with respect to that of now, (6, 6). What the
            process noise did in between is left out.
        """
        transition = np.eye(6)
        for leg in reversed(self._legs):
            if age <= 0.0:
                break
            duration = min(age, leg.duration)
            thrust = leg.acceleration @ hill_rotation(leg.chief)
            deputy, flight = advance_with_transition(deputy, thrust, -duration, substeps(duration))
            transition = flight @ transition
            age -= duration
        if age > 0.0:
            deputy, flight = advance_with_transition(deputy, _AT_REST, -age, substeps(age))
            transition = flight @ transition
        return deputy, transition


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings that the filter is to take at a tick."""

    sensor: np.ndarray
    """(k,) constants of `Sensor`."""
    value: Vector
    """(k,) in the unit of the sensor."""
    age: Vector
    """(k,) s."""
    variance: Vector
    """(k,) of the noise."""
    chief: Vector
    """(6,) the chief's inertial state now."""
    track: StateHistory
    late: bool
    """Whether any of them is older than now."""

    def expected(self, state: Vector) -> tuple[Vector, Matrix]:
        """(k,) readings without noise at a relative state now (6,), and their Jacobian (k, 6) with respect
        to it."""
        if not self.late:
            now: tuple[Vector, Matrix] = kernels.read_relative(self.sensor, self.chief, state)
            return now
        deputy = inertial_from_relative(self.chief, state)
        to_inertial = hill_transform_inverse(self.chief)
        readings, jacobian = np.empty(len(self.sensor)), np.empty((len(self.sensor), 6))
        for row, age in enumerate(self.age.tolist()):
            then, transition = self.track.back(deputy, age)
            chief = kernels.coast(self.chief, _AT_REST, -age, substeps(age)) if age else self.chief
            reading, derivative = kernels.read(self.sensor[row : row + 1], then, chief)
            readings[row], jacobian[row] = reading[0], derivative[0] @ transition @ to_inertial
        return readings, jacobian

    def innovation(self, expected: Vector) -> Vector:
        """(..., k) reading minus expectation (..., k), angles the short way round."""
        difference: Vector = self.value - expected
        if _RIGHT_ASCENSION in self.sensor.tolist():
            turning = self.sensor == _RIGHT_ASCENSION
            difference[..., turning] = (difference[..., turning] + pi) % (2.0 * pi) - pi
        return difference

    def select(self, chosen: np.ndarray) -> "Readings":
        """Those for which the mask (k,) holds."""
        return Readings(
            self.sensor[chosen],
            self.value[chosen],
            self.age[chosen],
            self.variance[chosen],
            self.chief,
            self.track,
            self.late,
        )


def pseudo_measurements(sensor: np.ndarray, reading: Vector, chief_radius: float) -> Vector:
    """Neokleous' pseudo-measurements (3.13) instead of radius, range rate and latitude.

    y1 = r^2 - r_c^2, y2 = (1/2) d(r^2)/dt = r r', y3 = r sin(latitude). The last is the height above the
    equator, which is the cross-track position only about an equatorial chief.

    Args:
        sensor: (k,) constants of `Sensor`; a radius among them.
        reading: (..., k).
        chief_radius: m.

    Returns:
        (..., k): m^2, m^2/s and m in place of the three; other readings as they are.
    """
    out = reading.copy()
    radius = reading[..., sensor == Sensor.RADIUS]
    squared, rated, raised = (sensor == each for each in (Sensor.RADIUS, Sensor.RANGE_RATE, Sensor.LATITUDE))
    out[..., squared] = (radius - chief_radius) * (radius + chief_radius)
    out[..., rated] = radius * reading[..., rated]
    out[..., raised] = radius * np.sin(reading[..., raised])
    return out


def pseudo_jacobian(sensor: np.ndarray, reading: Vector) -> Matrix:
    """(k, k) derivative of `pseudo_measurements` with respect to readings (k,)."""
    out = np.eye(len(sensor))
    (row,) = np.flatnonzero(sensor == Sensor.RADIUS)
    radius = reading[row]
    out[row, row] = 2.0 * radius
    for index in np.flatnonzero(sensor == Sensor.RANGE_RATE):
        out[index, index], out[index, row] = radius, reading[index]
    for index in np.flatnonzero(sensor == Sensor.LATITUDE):
        out[index, index], out[index, row] = radius * np.cos(reading[index]), np.sin(reading[index])
    return out
