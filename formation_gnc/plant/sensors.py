"""What a deputy's sensors read of the truth."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, gcd, hypot, sqrt

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import parameter
from formation_gnc.randomness import generator
from formation_gnc.records import Sensor
from formation_gnc.types import NANOSECONDS, Vector

DRAWN_AHEAD = 16
"""Readings whose random numbers are drawn at a time: a draw on its own, amid other work, costs a multiple."""


@dataclass(frozen=True)
class SensorParameters:
    """Error model of one sensor."""

    on: bool = parameter(True, doc="whether the sensor reads at all")
    sigma: float = parameter(1.0, minimum=0.0, doc="standard deviation of the noise, in the unit of the reading")
    bias: float = parameter(0.0, doc="constant error, in the unit of the reading")
    interval: float = parameter(10.0, unit="s", above=0.0, doc="time between readings; whole ticks")
    latency: float = parameter(0.0, unit="s", minimum=0.0, doc="time from a reading to its delivery; whole ticks")
    dropout: float = parameter(0.0, minimum=0.0, maximum=1.0, doc="probability that a reading is never delivered")
    outlier: float = parameter(0.0, minimum=0.0, maximum=1.0, doc="probability that a reading is an outlier")
    outlier_size: float = parameter(
        50.0, minimum=0.0, doc="error of an outlier, of either sign, in standard deviations"
    )


@dataclass(frozen=True)
class SensorSuite:
    """The sensors of a deputy and its acquisition fix."""

    radius: SensorParameters = SensorParameters(sigma=5.0)
    range_rate: SensorParameters = SensorParameters(sigma=0.01)
    latitude: SensorParameters = SensorParameters(sigma=1e-6)
    right_ascension: SensorParameters = SensorParameters(on=False, sigma=1e-6)
    chief_range: SensorParameters = SensorParameters(on=False, sigma=1.0)
    outage_start: float = parameter(0.0, unit="s", minimum=0.0, doc="time from which no sensor reads for a while")
    outage_duration: float = parameter(0.0, unit="s", minimum=0.0, doc="how long; 0 for never")
    fix_position_sigma: float = parameter(
        0.5, unit="m", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )
    fix_velocity_sigma: float = parameter(
        0.0005, unit="m/s", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )


def read(sensor: Sensor, state: Vector, chief: Vector) -> float:
    """The reading of a sensor, without its errors.

    Args:
        sensor: which.
        state: inertial state of the satellite, (6,), m and m/s.
        chief: the same of the chief, which only its range depends on.
    """
    numbers: list[float] = state.tolist()
    x, y, z, vx, vy, vz = numbers
    if sensor is Sensor.RADIUS:
        return sqrt(x * x + y * y + z * z)
    if sensor is Sensor.RANGE_RATE:
        return (x * vx + y * vy + z * vz) / sqrt(x * x + y * y + z * z)
    if sensor is Sensor.LATITUDE:
        return atan2(z, hypot(x, y))
    if sensor is Sensor.RIGHT_ASCENSION:
        return atan2(y, x)
    cx, cy, cz = chief[:3].tolist()
    return hypot(x - cx, y - cy, z - cz)


class _Instrument:
    """One sensor, with random numbers of its own: nothing about another sensor changes its errors."""

    def __init__(self, sensor: Sensor, model: SensorParameters, tick_ns: int, seed: int, deputy: str) -> None:
        name = f"{deputy}.sensors.{sensor.name.lower()}"
        self.sensor, self._model = sensor, model
        self._every = _whole_ticks(f"{name}.interval", model.interval, tick_ns)
        self._late = _whole_ticks(f"{name}.latency", model.latency, tick_ns)
        if self._every < 1:
            raise ConfigurationError(
                f"parameter {name}.interval: {model.interval!r} s is not allowed; it must be a tick or more"
            )
        self._draws = _draws(generator(seed, f"{deputy}/sensors/{sensor.name.lower()}"))
        self.age = self._late * tick_ns / NANOSECONDS
        self.beat = gcd(self._every, self._late)
        self._under_way: list[tuple[int, float]] = []

    def read(self, tick: int, state: Vector, chief: Vector, outage: bool) -> float | None:
        """Take the reading that is due at a tick; returns the one that arrives at it, if one does."""
        if tick % self._every == 0:
            model = self._model
            # Always drawn, so that an error switched on leaves the others as they were.
            noise, (dropped, stray, side) = next(self._draws)
            if dropped >= model.dropout and not outage:
                if stray < model.outlier:
                    noise += model.outlier_size if side < 0.5 else -model.outlier_size
                value = read(self.sensor, state, chief) + model.bias + model.sigma * noise
                self._under_way.append((tick + self._late, value))
        if self._under_way and self._under_way[0][0] == tick:
            return self._under_way.pop(0)[1]
        return None


def _draws(random: np.random.Generator) -> Iterator[tuple[float, list[float]]]:
    """For reading after reading: its noise, and three numbers that decide on dropout and outlier."""
    while True:
        yield from [(random.standard_normal(), random.random(3).tolist()) for _ in range(DRAWN_AHEAD)]


class Sensors:
    """All sensors of one deputy, with their errors."""

    def __init__(self, parameters: SensorSuite, tick_ns: int, seed: int, deputy: str) -> None:
        """Prepare readings at every interval.

        Args:
            parameters: error models.
            tick_ns: time between ticks, ns.
            seed: of the run.
            deputy: name, for the random streams and messages.

        Raises:
            ConfigurationError: an interval or a latency that is not a whole number of ticks.
        """
        suite = [(sensor, getattr(parameters, sensor.name.lower())) for sensor in Sensor]
        self._instruments = [_Instrument(sensor, model, tick_ns, seed, deputy) for sensor, model in suite if model.on]
        self._beat = gcd(*(instrument.beat for instrument in self._instruments))
        """Ticks between which nothing is read and nothing arrives; 0 when no sensor is on."""
        self._fixes = generator(seed, f"{deputy}/fixes")
        self._fix_sigma = np.repeat([parameters.fix_position_sigma, parameters.fix_velocity_sigma], 3)
        self._outage = (parameters.outage_start, parameters.outage_start + parameters.outage_duration)
        self._tick_ns = tick_ns

    def readings(self, tick: int, state: Vector, chief: Vector) -> tuple[list[int], list[float], list[float]]:
        """What arrives at a tick: sensors, values and ages (s); called at every tick, in order.

        Args:
            tick: number of the tick.
            state: inertial state of the deputy at it, (6,), m and m/s.
            chief: the same of the chief.
        """
        sensors: list[int] = []
        readings: list[float] = []
        ages: list[float] = []
        if not self._instruments or tick % self._beat:
            return sensors, readings, ages
        outage = self._outage[0] <= tick * self._tick_ns / NANOSECONDS < self._outage[1]
        for instrument in self._instruments:
            value = instrument.read(tick, state, chief, outage)
            if value is not None:
                sensors.append(int(instrument.sensor))
                readings.append(value)
                ages.append(instrument.age)
        return sensors, readings, ages

    def fix(self, relative_state: Vector) -> Vector:
        """An acquisition fix: the relative state (6,) with its error."""
        return relative_state + self._fix_sigma * self._fixes.standard_normal(6)


def _whole_ticks(name: str, duration: float, tick_ns: int) -> int:
    ticks, rest = divmod(round(duration * NANOSECONDS), tick_ns)
    if rest:
        raise ConfigurationError(
            f"parameter {name}: {duration!r} s is not allowed; "
            f"it must be a whole number of ticks of {tick_ns / NANOSECONDS:g} s"
        )
    return ticks
