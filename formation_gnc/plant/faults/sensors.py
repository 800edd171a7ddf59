"""Faults of sensors: what becomes of a reading when it is taken."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from formation_gnc.common import LAST_SECOND, whole_ticks
from formation_gnc.errors import ParameterError, nearest
from formation_gnc.parameters import parameter
from formation_gnc.plant.faults.fault import Fault, Memory, amount
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import NANOSECONDS

if TYPE_CHECKING:
    from formation_gnc.plant.parameters import DeputyParameters


@dataclass(slots=True)
class Sample:
    """A reading when it is taken."""

    sensor: str
    """Name under which it is delivered."""
    values: Sequence[float]
    noise: Sequence[float]
    """Random part of the values, outliers of the error model included."""
    sigma: Sequence[float]
    """Standard deviation of each value."""
    age: int
    """Age that it is delivered with, ns."""
    delay: int = 0
    """Time beyond the sensor's latency until it is delivered, ns."""
    lost: bool = False
    """Whether it is never delivered."""


@dataclass(frozen=True, kw_only=True)
class SensorFault(Fault[Sample]):
    """A fault of one sensor."""

    sensor: str = parameter(doc="name of the sensor, which must be on")

    @property
    def unit(self) -> str:
        """Unit of the sensor's values."""
        return sensors()[self.sensor].unit

    def concerns(self, sensor: str) -> bool:
        """Whether it may change the readings of a sensor."""
        return sensor == self.sensor

    def stream(self, name: str) -> str:
        """Name of its stream of random numbers; every sensor has its own."""
        return f"{super().stream(name)}/{self.sensor}"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `Fault.check`; the sensor must be on."""
        super().check(deputy, tick_ns)
        self.require_on("sensor", self.sensor, deputy)

    def require_on(self, field: str, sensor: str, deputy: "DeputyParameters") -> None:
        """Raise ParameterError unless the deputy has this sensor, which a field names, and it is on."""
        if sensor not in sensors():
            raise ParameterError(f"{field}: {sensor!r} is unknown; {nearest(sensor, sensors())}")
        if not getattr(deputy.sensors, sensor).on:
            on = ", ".join(name for name in sensors() if getattr(deputy.sensors, name).on) or "none"
            raise ParameterError(f"{field}: {sensor!r} is not allowed; it is off, sensors on {self.deputy} are: {on}")

    def require_size(self, field: str, numbers: Sequence[float]) -> None:
        """Raise ParameterError unless a field has one number, or one for each value of the sensor's readings."""
        size = sensors()[self.sensor].size
        if len(numbers) not in (1, size):
            allowed = "one number" + (f", or {size}: one for each value of {self.sensor}" if size > 1 else "")
            raise ParameterError(f"{field}: {list(numbers)} is not allowed; it must be {allowed}")


@dataclass(frozen=True, kw_only=True)
class Bias(SensorFault):
    """A constant error is added."""

    value: tuple[float, ...] = parameter(
        unit="the sensor's", minimum=-1e12, maximum=1e12, doc="error of every value, or of each"
    )

    @property
    def words(self) -> str:
        """With the error."""
        return f"{self.sensor} biased by {amount(self.value, self.unit)}"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `SensorFault.check`, with the number of values."""
        super().check(deputy, tick_ns)
        self.require_size("value", self.value)

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Add it."""
        subject.values = _sum(subject.values, self.value)


@dataclass(frozen=True, kw_only=True)
class Drift(SensorFault):
    """An error grows with the time since it began."""

    rate: tuple[float, ...] = parameter(
        unit="the sensor's, per s", minimum=-1e9, maximum=1e9, doc="growth of the error of every value, or of each"
    )

    @property
    def words(self) -> str:
        """With the rate."""
        return f"{self.sensor} drifting by {amount(self.rate, f'{self.unit} per s')}"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `SensorFault.check`, with the number of values."""
        super().check(deputy, tick_ns)
        self.require_size("rate", self.rate)

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Add what it has come to."""
        subject.values = _sum(subject.values, [elapsed * each for each in self.rate])


@dataclass(frozen=True, kw_only=True)
class Freeze(SensorFault):
    """The last reading before it is repeated, at the times of new ones; the first one where there was none."""

    @property
    def words(self) -> str:
        """Of the sensor."""
        return f"{self.sensor} frozen"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Repeat the values held."""
        if memory.held is None:
            memory.held = subject.values
        subject.values = list(memory.held)

    def watch(self, subject: Sample, memory: Memory) -> None:
        """Hold the last values."""
        memory.held = subject.values


@dataclass(frozen=True, kw_only=True)
class Scale(SensorFault):
    """Readings are multiplied, errors included."""

    factor: float = parameter(minimum=-1e6, maximum=1e6, doc="factor of every value")

    @property
    def words(self) -> str:
        """With the factor."""
        return f"{self.sensor} times {self.factor:g}"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Multiply."""
        subject.values = [self.factor * each for each in subject.values]


@dataclass(frozen=True, kw_only=True)
class Dropout(SensorFault):
    """Readings are lost: all of them, which is a dead sensor, or a share at random."""

    share: float = parameter(1.0, above=0.0, maximum=1.0, doc="probability that a reading is lost")

    @property
    def words(self) -> str:
        """With the share."""
        return f"{self.sensor} {'dead' if self.share == 1.0 else f'losing a share of {self.share:g}'}"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Lose it, or not."""
        if memory.random.random() < self.share:
            subject.lost = True


@dataclass(frozen=True, kw_only=True)
class Noise(SensorFault):
    """The random error of the sensor, outliers included, is multiplied."""

    factor: float = parameter(minimum=0.0, maximum=1e6, doc="factor of the random error")

    @property
    def words(self) -> str:
        """With the factor."""
        return f"noise of {self.sensor} times {self.factor:g}"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Add what it lacks of its multiple."""
        more = [(self.factor - 1.0) * each for each in subject.noise]
        subject.values, subject.noise = _sum(subject.values, more), _sum(subject.noise, more)


@dataclass(frozen=True, kw_only=True)
class Outliers(SensorFault):
    """A share of the readings, at random, errs by a multiple of the noise, to either side."""

    share: float = parameter(above=0.0, maximum=1.0, doc="probability that a reading is an outlier")
    size: float = parameter(
        50.0, minimum=0.0, maximum=1e9, doc="error of an outlier, of either sign, in standard deviations"
    )

    @property
    def words(self) -> str:
        """With share and size."""
        return f"{self.sensor} with a share of {self.share:g} outliers of {self.size:g} standard deviations"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Make it an outlier, or not."""
        stray, side = memory.random.random(2).tolist()
        if stray < self.share:
            size = self.size if side < 0.5 else -self.size
            subject.values = _sum(subject.values, [size * each for each in subject.sigma])


@dataclass(frozen=True, kw_only=True)
class Swap(SensorFault):
    """Two sensors are exchanged: each one's readings are delivered as the other's, when they are."""

    other: str = parameter(doc="name of the other sensor, which must be on, with as many values")

    @property
    def words(self) -> str:
        """Of both sensors."""
        return f"{self.sensor} and {self.other} swapped"

    def concerns(self, sensor: str) -> bool:
        """An earlier swap may have brought it any sensor's readings."""
        return True

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `SensorFault.check`, with the other sensor."""
        super().check(deputy, tick_ns)
        self.require_on("other", self.other, deputy)
        size, other = sensors()[self.sensor].size, sensors()[self.other].size
        if self.other == self.sensor or other != size:
            raise ParameterError(
                f"other: {self.other!r} is not allowed; it must be another sensor with readings of {size} value(s), "
                f"as {self.sensor}"
            )

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Exchange the names."""
        subject.sensor = {self.sensor: self.other, self.other: self.sensor}.get(subject.sensor, subject.sensor)


@dataclass(frozen=True, kw_only=True)
class Late(SensorFault):
    """Readings are delivered later than the sensor's latency."""

    delay: float = parameter(unit="s", above=0.0, maximum=LAST_SECOND, doc="time beyond the latency; whole ticks")
    told: bool = parameter(True, doc="whether a reading's age says so")

    @property
    def words(self) -> str:
        """With the delay."""
        return f"{self.sensor} late by {self.delay:g} s, {'' if self.told else 'not '}told"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `SensorFault.check`; the delay must be whole ticks."""
        super().check(deputy, tick_ns)
        whole_ticks("delay", self.delay, tick_ns)

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        """Delay it."""
        delay = round(self.delay * NANOSECONDS)
        subject.delay += delay
        subject.age += delay if self.told else 0


def _sum(values: Sequence[float], more: Sequence[float]) -> list[float]:
    """Values with one number added to all, or one to each."""
    each = more if len(more) == len(values) else [more[0]] * len(values)
    return [value + one for value, one in zip(values, each, strict=True)]
