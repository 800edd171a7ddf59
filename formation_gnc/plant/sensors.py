"""What a deputy's sensors read of the truth."""

from dataclasses import dataclass
from math import atan2, hypot, sqrt

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.interface import NANOSECONDS, Sensor, Vector
from formation_gnc.parameters import parameter


@dataclass(frozen=True)
class SensorParameters:
    """Error model of one sensor."""

    sigma: float = parameter(minimum=0.0, doc="standard deviation of the noise, in the unit of the reading")
    interval: float = parameter(10.0, unit="s", above=0.0, doc="time between readings; whole ticks")


@dataclass(frozen=True)
class SensorSuite:
    """The sensors of a deputy and its acquisition fix."""

    radius: SensorParameters = SensorParameters(sigma=5.0)
    range_rate: SensorParameters = SensorParameters(sigma=0.01)
    latitude: SensorParameters = SensorParameters(sigma=1e-6)
    fix_position_sigma: float = parameter(
        0.5, unit="m", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )
    fix_velocity_sigma: float = parameter(
        0.0005, unit="m/s", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )


def read(sensor: Sensor, state: Vector) -> float:
    """The noise-free reading of a sensor on a satellite with this inertial state (6,), m and m/s."""
    x, y, z, vx, vy, vz = state.tolist()
    if sensor is Sensor.RADIUS:
        return sqrt(x * x + y * y + z * z)
    if sensor is Sensor.RANGE_RATE:
        return (x * vx + y * vy + z * vz) / sqrt(x * x + y * y + z * z)
    if sensor is Sensor.LATITUDE:
        return atan2(z, hypot(x, y))
    raise ConfigurationError(f"no model of a {sensor.name.lower()} sensor")


class Sensors:
    """All sensors of one deputy, with their noise."""

    def __init__(
        self, parameters: SensorSuite, tick_ns: int, noise: np.random.Generator, fixes: np.random.Generator
    ) -> None:
        """Prepare readings at every interval.

        Args:
            parameters: error models.
            tick_ns: time between ticks, ns.
            noise: random stream of the readings.
            fixes: random stream of the acquisition fixes.

        Raises:
            ConfigurationError: an interval that is not a whole number of ticks.
        """
        self._noise, self._fixes = noise, fixes
        self._suite = [
            (Sensor.RADIUS, parameters.radius),
            (Sensor.RANGE_RATE, parameters.range_rate),
            (Sensor.LATITUDE, parameters.latitude),
        ]
        self._ticks = [_whole_ticks(kind, each.interval, tick_ns) for kind, each in self._suite]
        self._fix_sigma = np.repeat([parameters.fix_position_sigma, parameters.fix_velocity_sigma], 3)

    def readings(self, tick: int, state: Vector) -> tuple[list[int], list[float]]:
        """The sensors that read at a tick, and what they read of an inertial state (6,)."""
        sensors: list[int] = []
        readings: list[float] = []
        for (sensor, model), ticks in zip(self._suite, self._ticks, strict=True):
            if tick % ticks == 0:
                sensors.append(int(sensor))
                readings.append(read(sensor, state) + model.sigma * self._noise.standard_normal())
        return sensors, readings

    def fix(self, relative_state: Vector) -> Vector:
        """An acquisition fix: the relative state (6,) with its error."""
        return relative_state + self._fix_sigma * self._fixes.standard_normal(6)


def _whole_ticks(sensor: Sensor, interval: float, tick_ns: int) -> int:
    ticks, rest = divmod(round(interval * NANOSECONDS), tick_ns)
    if rest or ticks < 1:
        raise ConfigurationError(
            f"parameter {sensor.name.lower()}.interval: {interval!r} s is not allowed; "
            f"it must be a whole number of ticks of {tick_ns / NANOSECONDS:g} s"
        )
    return ticks
