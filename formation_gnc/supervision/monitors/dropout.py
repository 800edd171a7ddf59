"""Sensors that do not read."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, log

from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.thresholds import suspicion
from formation_gnc.types import NANOSECONDS

PRIOR_MISSED, PRIOR_DUE = 1.0, 5.0
"""A sensor starts as one that has missed one reading of five."""

LONGEST = 5.0
"""Intervals of a silence that count for the share of missed readings: a longer one is a fault, not chance."""

NEVER = 600.0
"""Time without a first reading that is a failure, s."""


@dataclass(slots=True)
class _Rhythm:
    last: int
    interval: int = 0
    """Least time between two readings, ns."""
    has_gap: bool = False
    """Whether there were ticks since that were not observed."""
    due: float = PRIOR_DUE
    missed: float = PRIOR_MISSED


class Dropout(Monitor):
    """Missing readings in a row, against the share that this sensor is used to missing.

    The interval is the least one seen. With a share q of missing readings, n in a row have a chance of q^n.

    Assumes: readings are missed independently of one another; a steady interval.
    Cannot see: readings that come but are wrong.
    Delay: ln(p / ticks) / ln(q) intervals.
    """

    name = "dropout"
    title = "missing readings in a row"
    test = "intervals without a finite reading; the chance of a miss is the sensor's own so far"
    when = When.READINGS | When.SLOW | When.GAP

    def prepare(self) -> None:
        """Probabilities of each sensor in use."""
        share = self.probability / len(self.parameters.sensors)
        self._failed = log(share / self.parameters.ticks)
        self._suspect = log(suspicion(share) / self.parameters.ticks)
        self._rhythms: dict[str, _Rhythm] = {}
        self._start: int | None = None

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The sensors."""
        return parameters.sensors

    def feed(self, observation: Observation) -> None:
        """Take the readings of a tick, and judge the silence of each sensor at slow ticks."""
        if self._start is None:
            self._start = observation.time
        if observation.missed:
            for rhythm in self._rhythms.values():
                rhythm.has_gap = True
        measurement = observation.measurement
        if measurement is not None and measurement.readings:
            for reading in measurement.readings:
                if reading.sensor in self.parameters.sensors and isfinite(sum(reading.values)):
                    self._take(reading.sensor, measurement.time - reading.age)
        if observation.slow:
            for name in self.parameters.sensors:
                self._judge_silence(name, observation.time)

    def _take(self, name: str, taken: int) -> None:
        rhythm = self._rhythms.get(name)
        if rhythm is None:
            self._rhythms[name] = _Rhythm(taken)
            return
        gap = taken - rhythm.last
        if gap <= 0:
            return
        if not rhythm.has_gap:  # else it may have read at a tick that was not observed
            rhythm.interval = min(gap, rhythm.interval or gap)
            due = min(gap / rhythm.interval, LONGEST)
            rhythm.due += due
            rhythm.missed += due - 1.0
        rhythm.last, rhythm.has_gap = taken, False

    def _judge_silence(self, name: str, time: int) -> None:
        rhythm = self._rhythms.get(name)
        if rhythm is None or not rhythm.interval:
            since = self._start if rhythm is None else rhythm.last
            silence = (time - (since or 0)) / NANOSECONDS
            self.judge(name, silence / NEVER, 0.5, 1.0)
            return
        silent = (time - rhythm.last) / rhythm.interval - 1.0
        if silent <= 0.0:
            self.judge(name, 0.0, 1.0, 2.0)
            return
        chance = log(min(0.5, rhythm.missed / rhythm.due))
        self.judge(name, silent, max(1.0, self._suspect / chance), max(2.0, self._failed / chance))
