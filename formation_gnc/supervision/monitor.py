"""What a health monitor is: fed one observation a tick, it returns its verdicts."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Flag, IntEnum, auto
from math import inf, isnan
from typing import ClassVar

from formation_gnc.mode_records import MonitorStatus
from formation_gnc.records import Estimate, Measurement, Separation, Status, Target
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.reckoning import Reckoning
from formation_gnc.supervision.thrust_tally import ThrustTally


class Level(IntEnum):
    """How bad it is."""

    OK = 0
    SUSPECT = 1
    FAILED = 2


class When(Flag):
    """Which ticks a monitor is fed."""

    READINGS = auto()
    """Those with readings or innovations."""
    SLOW = auto()
    """Every tenth, or one in two minutes, at which there is a comparison."""
    RARE = auto()
    """Those of the slow ones that are about a minute apart: for what changes within much of a revolution."""
    THRUST = auto()
    """Those at which the sum of a thruster is suspect, and the first one at which it is no more."""
    SEPARATION = auto()
    """Those at which guidance has predicted separations."""
    GAP = auto()
    """The first one, and those after ticks that were not observed."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a monitor says of a subject at a tick."""

    monitor: str
    subject: str
    """Sensor or axis; empty for the satellite."""
    level: Level
    statistic: float
    threshold: float
    """Of the statistic, for a failure."""
    reason: str = ""
    """Why there is no statistic, where the monitor itself has failed."""

    @property
    def status(self) -> MonitorStatus:
        """The record of it."""
        return MonitorStatus(self.monitor, self.subject, int(self.level), self.statistic, self.threshold)

    def __str__(self) -> str:
        """One line for people."""
        found = self.reason or f"{self.statistic:.3g}, where {self.threshold:.3g} is the limit"
        return f"{self.monitor}: {found}"


@dataclass(slots=True)
class Observation:
    """All that the monitors see of a tick. Times increase from one to the next."""

    time: int
    """Stamp, ns."""
    missed: int
    """Ticks before this one that were not observed; 1 at the first one."""
    slow: bool
    """Whether this is a tick of `When.SLOW`."""
    mode: Mode
    """In force over the tick that begins now."""
    measurement: Measurement | None
    estimate: Estimate | None
    """None as well where its numbers are not finite."""
    target: Target | None
    status: Status | None
    separation: Separation | None
    """Predicted by guidance, at some ticks."""
    thrust: ThrustTally
    """Of all ticks so far."""
    reckoning: Reckoning | None
    """Comparison of ephemeris and estimate with their own propagation, at slow ticks."""


class Monitor(ABC):
    """A health monitor. It keeps what it needs of earlier ticks; the docstring of each says what it cannot see.

    A new one is a file in `monitors/` and a line in `registry.py`.
    """

    name: ClassVar[str]
    """In fault tables and verdicts."""
    title: ClassVar[str]
    """What it watches, in words, for the table of monitors."""
    test: ClassVar[str]
    """How it decides, in words."""
    when: ClassVar[When] = When.SLOW
    """Ticks that it is fed."""
    is_of_filter: ClassVar[bool] = False
    """Whether what it remembers is of a run of the filter, and tells nothing of another one."""

    def __init__(self, parameters: SupervisorParameters, probability: float) -> None:
        """Prepare for a flight.

        Args:
            parameters: of supervision.
            probability: of a false alarm of this monitor in the whole flight.
        """
        self.parameters, self.probability = parameters, probability
        self.notable: dict[str, Verdict] = {}
        """The latest verdicts that are not well, by subject."""
        self._well: dict[str, tuple[float, float]] = {}
        """Statistic and threshold of those that are: no object is built for them at every tick."""
        self.prepare()

    def prepare(self) -> None:  # noqa: B027 - optional
        """Compute thresholds and clear the memory."""

    @abstractmethod
    def feed(self, observation: Observation) -> None:
        """Take the observation of a tick of `when`, and `judge` the subjects of which it tells something."""

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """What its verdicts may be about."""
        return ("",)

    def judge(self, subject: str, statistic: float, suspect: float, failed: float) -> None:
        """Set the verdict on a subject; a statistic that is not a number is a failure."""
        if statistic < suspect:
            self._well[subject] = statistic, failed
            if self.notable:
                self.notable.pop(subject, None)
            return
        level = Level.SUSPECT if statistic < failed else Level.FAILED
        self._well.pop(subject, None)
        self.notable[subject] = Verdict(self.name, subject, level, inf if isnan(statistic) else statistic, failed)

    def fail(self, reason: str) -> None:
        """Set the verdict that the monitor itself has failed, and why."""
        self.notable[""] = Verdict(self.name, "", Level.FAILED, inf, 1.0, reason)

    def forget(self, subject: str) -> None:
        """Take back the verdict on a subject that is not watched any more."""
        self._well.pop(subject, None)
        self.notable.pop(subject, None)

    def verdicts(self) -> Iterator[Verdict]:
        """The latest one on each subject."""
        for subject, (statistic, threshold) in self._well.items():
            yield Verdict(self.name, subject, Level.OK, statistic, threshold)
        yield from self.notable.values()
