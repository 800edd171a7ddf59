"""Readings of a deputy's sensors: the measurement functions of the truth, with an error model each."""

from bisect import insort
from collections.abc import Iterator
from dataclasses import dataclass, make_dataclass
from math import gcd
from operator import itemgetter
from typing import Any

import numpy as np

from formation_gnc.common import whole_ticks
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import parameter, with_fields
from formation_gnc.plant.faults.injection import SatelliteFaults
from formation_gnc.plant.faults.sensors import Sample
from formation_gnc.randomness import generator
from formation_gnc.records import Reading
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import Sensor, per_value
from formation_gnc.types import NANOSECONDS, Vector

DRAWN_AHEAD = 16
"""Readings whose random numbers are drawn in one go: single draws amid other work cost a multiple."""


@dataclass(frozen=True)
class ErrorModel:
    """Error model of any sensor, without the numbers in its unit."""

    on: bool = parameter(True, doc="whether the sensor reads at all")
    interval: float = parameter(10.0, unit="s", above=0.0, doc="time between readings; whole ticks")
    latency: float = parameter(0.0, unit="s", minimum=0.0, doc="time from a reading to its delivery; whole ticks")
    dropout: float = parameter(0.0, minimum=0.0, maximum=1.0, doc="probability that a reading is never delivered")
    outlier: float = parameter(0.0, minimum=0.0, maximum=1.0, doc="probability that a reading is an outlier")
    outlier_size: float = parameter(
        50.0, minimum=0.0, doc="error of an outlier, of either sign, in standard deviations"
    )


def error_model(sensor: Sensor) -> type[ErrorModel]:
    """Schema of a sensor's error model: `sigma` and `bias` have a number for each value of a reading."""
    sigma = sensor.declare(sensor.sigma, minimum=0.0, doc="standard deviation of the noise")
    bias = sensor.declare((0.0,) * sensor.size, doc="constant error")
    return make_dataclass(
        "ErrorModel", [("sigma", *sigma), ("bias", *bias)], bases=(ErrorModel,), frozen=True, kw_only=True
    )


def _error_models() -> Iterator[tuple[str, type[ErrorModel], ErrorModel]]:
    for sensor in sensors().values():
        model = error_model(sensor)
        yield sensor.name, model, model(on=sensor.on)


@dataclass(frozen=True, kw_only=True)
@with_fields(_error_models())
class SensorSuite:
    """Error models of a deputy's sensors, by their names, and of its acquisition fix."""

    outage_start: float = parameter(0.0, unit="s", minimum=0.0, doc="time from which no sensor reads for a while")
    outage_duration: float = parameter(0.0, unit="s", minimum=0.0, doc="how long; 0 for never")
    fix_position_sigma: float = parameter(
        0.5, unit="m", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )
    fix_velocity_sigma: float = parameter(
        0.0005, unit="m/s", minimum=0.0, doc="standard deviation of an acquisition fix, each axis"
    )


class _Instrument:
    """One sensor of a deputy, with a random stream of its own."""

    def __init__(self, sensor: Sensor, model: Any, tick_ns: int, seed: int, deputy: str) -> None:
        name = f"{deputy}.sensors.{sensor.name}"
        self._sensor, self._model = sensor, model
        self._bias, self._sigma = per_value(model.bias), per_value(model.sigma)
        self._interval = whole_ticks(f"{name}.interval", model.interval, tick_ns)
        self._latency = whole_ticks(f"{name}.latency", model.latency, tick_ns)
        if self._interval < 1:
            raise ConfigurationError(
                f"parameter {name}.interval: {model.interval!r} s is not allowed; it must be a tick or more"
            )
        self._draws = _draws(generator(seed, f"{deputy}/sensors/{sensor.name}"), sensor.size)
        self._age, self._tick_ns = self._latency * tick_ns, tick_ns
        self.beat = gcd(self._interval, self._latency)
        self.faults: SatelliteFaults | None = None
        self._in_transit: list[tuple[int, Reading]] = []

    def read(self, tick: int, deputy: list[float], chief: list[float], outage: bool, arrived: list[Reading]) -> None:
        """Take the reading that is due at a tick; adds those that arrive at it to others."""
        if tick % self._interval == 0:
            # Drawn even when unused: switching one error on leaves the others as they were.
            noise, (dropped, stray, side) = next(self._draws)
            if dropped >= self._model.dropout and not outage:
                if stray < self._model.outlier:
                    offset = self._model.outlier_size if side < 0.5 else -self._model.outlier_size
                    noise = [each + offset for each in noise]
                truth = self._sensor.measure(deputy, chief)
                errors = zip(truth, self._bias, self._sigma, noise, strict=True)
                values = [value + bias + sigma * each for value, bias, sigma, each in errors]
                if self.faults is None:
                    self._in_transit.append((tick + self._latency, Reading(self._sensor.name, values, self._age)))
                else:
                    self._read_with(self.faults, tick, values, noise)
        while self._in_transit and self._in_transit[0][0] == tick:
            arrived.append(self._in_transit.pop(0)[1])

    def _read_with(self, faults: SatelliteFaults, tick: int, values: list[float], noise: list[float]) -> None:
        random = [sigma * each for sigma, each in zip(self._sigma, noise, strict=True)]
        sample = Sample(self._sensor.name, values, random, self._sigma, self._age)
        faults.read(self._sensor.name, sample, tick * self._tick_ns)
        if not sample.lost:
            arrival = tick + self._latency + sample.delay // self._tick_ns
            reading = Reading(sample.sensor, list(sample.values), sample.age)
            insort(self._in_transit, (arrival, reading), key=itemgetter(0))


def _draws(random: np.random.Generator, size: int) -> Iterator[tuple[list[float], list[float]]]:
    """For each reading: the noise of its values, and three numbers that decide on dropout and outlier."""
    while True:
        yield from [
            ([random.standard_normal() for _ in range(size)], random.random(3).tolist()) for _ in range(DRAWN_AHEAD)
        ]


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
        suite = [(sensor, getattr(parameters, name)) for name, sensor in sensors().items()]
        self._instruments = [_Instrument(sensor, model, tick_ns, seed, deputy) for sensor, model in suite if model.on]
        self._beat = gcd(*(instrument.beat for instrument in self._instruments))
        """Ticks between which nothing is read and nothing arrives; 0 when no sensor is on."""
        self._fixes = generator(seed, f"{deputy}/fixes")
        self._fix_sigma = np.repeat([parameters.fix_position_sigma, parameters.fix_velocity_sigma], 3)
        self._outage = (parameters.outage_start, parameters.outage_start + parameters.outage_duration)
        self._tick_ns = tick_ns

    def readings(self, tick: int, deputy: Vector, chief: Vector) -> list[Reading]:
        """Readings that arrive at a tick; called at every tick, in order.

        Args:
            tick: number of the tick.
            deputy: inertial state at it, (6,), m and m/s.
            chief: the same of the chief.
        """
        if not self._instruments or tick % self._beat:
            return []
        outage = self._outage[0] <= tick * self._tick_ns / NANOSECONDS < self._outage[1]
        states, arrived = (deputy.tolist(), chief.tolist()), list[Reading]()
        for instrument in self._instruments:
            instrument.read(tick, *states, outage, arrived)
        return arrived

    def inject(self, faults: SatelliteFaults) -> None:
        """Take readings with these faults from now on."""
        self._beat = 1  # a late reading may arrive at any tick
        for instrument in self._instruments:
            instrument.faults = faults

    def fix(self, relative_state: Vector) -> Vector:
        """Acquisition fix: the relative state (6,) with its error."""
        return relative_state + self._fix_sigma * self._fixes.standard_normal(6)
