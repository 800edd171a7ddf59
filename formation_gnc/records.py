"""Records that the modules exchange at every tick.

A record mirrors its message in ``msg_defs/`` field by field; units and frames are given there. `time` is the
stamp of the header. Times and durations are int nanoseconds of simulated time.
"""

from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import ClassVar

import numpy as np

from formation_gnc.bounds import at_most, bounded, each, finite_state, orbit, within
from formation_gnc.types import Matrix, Times, Vector

NAME_LENGTH, LIST_LENGTH, ROWS = 1000, 1000, 20_000
"""Longest name, list of values of a sensor or of a measurement, and list of states, beyond any use."""


class Record:
    """Base of all records."""

    __slots__ = ()
    message: ClassVar[str]
    """Name of the message that the record mirrors, with its package if it is not ours.

    A record may lack fields of a message that it only reads.
    """
    frame_id: ClassVar[str] = ""
    """Frame named in the message's header."""


class EstimateStatus(IntEnum):
    """State of the filter; the constants of Estimate.msg."""

    TRACKING = 0
    ACQUIRED = 1
    COASTING = 2
    DIVERGED = 3
    CHIEF_LOST = 4


class Rejection(StrEnum):
    """Why something of a measurement was not used; the constants of RejectionCount.msg."""

    NOT_FINITE = "not_finite"
    GATE = "gate"
    ISOLATED = "isolated"
    FUTURE = "future"
    LATE = "late"
    DUPLICATE = "duplicate"
    UNKNOWN_SENSOR = "unknown_sensor"
    NO_DIRECTION = "no_direction"
    OUT_OF_ORDER = "out_of_order"
    WRONG_DEPUTY = "wrong_deputy"
    CHIEF = "chief"
    AVIONICS = "avionics"
    FIX = "fix"


class EventKind(IntEnum):
    """What happened; the constants of Event.msg."""

    PARAMETERS = 0
    REJECTED = 1
    HANDOVER = 2
    FALLBACK = 3
    ACQUIRED = 4
    LOST = 5
    DIVERGED = 6
    CHIEF = 7
    OBSERVABILITY = 8
    RECONFIGURATION = 9
    INFEASIBLE = 10
    ASSIGNMENT = 11
    SEPARATION = 12
    WARNING = 13
    MISS = 14
    THRUSTERS = 15
    END = 16
    FAULT = 17
    MODE = 18
    DETECTION = 19
    RESPONSE = 20


WARNINGS = frozenset(
    {
        EventKind.REJECTED,
        EventKind.FALLBACK,
        EventKind.LOST,
        EventKind.DIVERGED,
        EventKind.INFEASIBLE,
        EventKind.SEPARATION,
        EventKind.WARNING,
        EventKind.MISS,
        EventKind.THRUSTERS,
        EventKind.DETECTION,
        EventKind.RESPONSE,
    }
)
"""Kinds of events that somebody should look at."""


@dataclass(slots=True)
class Reading(Record):
    """What a sensor read."""

    message: ClassVar = "Reading"

    sensor: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    values: list[float] = field(metadata=bounded(at_most(LIST_LENGTH)))
    age: int


@dataclass(slots=True)
class Measurement(Record):
    """What a deputy knows at a tick: sensor readings, own avionics, the chief's ephemeris."""

    message: ClassVar = "Measurement"
    frame_id: ClassVar = "inertial"

    time: int
    deputy: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    chief_state: Vector  # (6,)
    readings: list[Reading] = field(metadata=bounded(each(LIST_LENGTH)))
    applied_force: Vector  # (3,)
    mass: float
    eclipse: bool
    fix_available: bool
    fix: Vector  # (6,)


@dataclass(slots=True)
class Innovation(Record):
    """How a reading compares with the filter's prediction."""

    message: ClassVar = "Innovation"

    sensor: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    values: list[float] = field(metadata=bounded(at_most(LIST_LENGTH)))
    standard_deviations: list[float] = field(metadata=bounded(at_most(LIST_LENGTH)))
    test_ratio: float
    rejection: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))


@dataclass(slots=True)
class RejectionCount(Record):
    """How often something of a measurement was rejected for one reason."""

    message: ClassVar = "RejectionCount"

    reason: str = field(metadata=bounded(at_most(NAME_LENGTH)))  # Rejection
    count: int


@dataclass(slots=True)
class NavigationState(Record):
    """Excerpt of an Estimate: all that guidance and control read of its message."""

    message: ClassVar = "Estimate"
    frame_id: ClassVar = "hill"

    time: int
    relative_state: Vector = field(metadata=bounded(finite_state))  # (6,)
    chief_state: Vector = field(metadata=bounded(orbit))  # (6,)
    mass: float = field(metadata=bounded(within(0.0, 1e9)))


@dataclass(slots=True)
class Estimate(NavigationState):
    """Relative state of a deputy as its filter knows it."""

    covariance: Matrix = field(metadata={"shape": (6, 6)})
    eclipse: bool
    innovations: list[Innovation] = field(metadata=bounded(each(LIST_LENGTH)))
    nis: float
    status: int  # EstimateStatus
    rejections: list[RejectionCount] = field(default_factory=list, metadata=bounded(each(LIST_LENGTH)))
    unobservable_direction: Vector = field(default_factory=lambda: np.zeros(6))  # (6,)
    unobservable: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))


NO_ECLIPSES: Times = np.empty((0, 2), dtype=np.int64)
NO_NEIGHBOURS: Matrix = np.empty((0, 6))


@dataclass(slots=True)
class Separation(Record):
    """Predicted least distances of a deputy to the other satellites of its fleet."""

    message: ClassVar = "Separation"
    frame_id: ClassVar = "hill"

    time: int
    planned: float
    planned_time: int
    planned_neighbour: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    passive: float
    passive_time: int
    passive_neighbour: str = field(metadata=bounded(at_most(NAME_LENGTH)))

    @property
    def nearest(self) -> str:
        """Name of the neighbour at the lesser of both distances."""
        return self.planned_neighbour if self.planned <= self.passive else self.passive_neighbour


@dataclass(slots=True)
class Target(Record):
    """Relative state that a deputy is to have, now and over the horizon."""

    message: ClassVar = "Target"
    frame_id: ClassVar = "hill"

    time: int
    formation: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    relative_state: Vector = field(metadata=bounded(finite_state))  # (6,)
    preview_step: int = field(metadata=bounded(within(1, 2**63 - 1)))
    preview: Matrix = field(metadata=bounded(at_most(ROWS, finite_state)))  # (N, 6), a row for each RelativeState
    eclipses: Times = field(default_factory=lambda: NO_ECLIPSES, metadata=bounded(at_most(ROWS)))  # (N, 2), by Interval
    neighbours: Matrix = field(default_factory=lambda: NO_NEIGHBOURS, metadata=bounded(at_most(ROWS, finite_state)))
    """(N, 6), a row for each RelativeState."""
    reconfiguring: bool = False
    separation: list[Separation] = field(default_factory=list, metadata=bounded(each(1)))
    """Predicted at this tick; empty where none is due."""


@dataclass(slots=True)
class Thrust(Record):
    """Force the thrusters are to give until the next tick, Hill frame, N."""

    message: ClassVar = "Thrust"
    frame_id: ClassVar = "hill"

    time: int
    force: Vector  # (3,)


@dataclass(slots=True)
class Status(Record):
    """How the controller came to its command."""

    message: ClassVar = "Status"
    frame_id: ClassVar = "hill"

    time: int
    algorithm: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    demand: Vector  # (3,)
    saturated: list[bool]
    solver: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))
    iterations: int = 0
    cost: float = 0.0
    fallback: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))
    mode: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))  # Mode


@dataclass(slots=True)
class Clock(Record):
    """Simulated time."""

    message: ClassVar = "rosgraph_msgs/Clock"

    clock: int

    @property
    def time(self) -> int:
        """As the stamp of other records."""
        return self.clock


@dataclass(slots=True)
class SatelliteTruth(Record):
    """True state of one deputy."""

    message: ClassVar = "SatelliteTruth"

    name: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    inertial_state: Vector = field(metadata=bounded(finite_state))  # (6,)
    relative_state: Vector = field(metadata=bounded(finite_state))  # (6,)
    applied_force: Vector  # (3,)
    mass: float
    eclipse: bool


@dataclass(slots=True)
class Truth(Record):
    """What really is."""

    message: ClassVar = "Truth"
    frame_id: ClassVar = "inertial"

    time: int
    chief_state: Vector = field(metadata=bounded(orbit))  # (6,)
    deputies: list[SatelliteTruth] = field(metadata=bounded(each(ROWS)))


@dataclass(slots=True)
class ParameterChange(Record):
    """A parameter that changed in flight, values as JSON."""

    message: ClassVar = "ParameterChange"

    name: str
    old_value: str
    new_value: str


@dataclass(slots=True)
class Event(Record):
    """Something that happened to the run."""

    message: ClassVar = "Event"

    time: int
    tick: int
    node: str
    kind: int  # EventKind
    subject: str = ""
    changes: list[ParameterChange] = field(default_factory=list)
    detail: str = ""

    def __str__(self) -> str:
        """One line for people."""
        return ": ".join(filter(None, [f"tick {self.tick}", kind_name(self.kind), self.subject, self.detail]))


def kind_name(kind: int) -> str:
    """Name of an event's kind in lower case; "kind 42" for one that this version does not know."""
    return EventKind(kind).name.lower() if kind in EventKind else f"kind {kind}"


@dataclass(slots=True)
class Timing(Record):
    """Wall time of a node's computation in a tick; apart from everything that must be reproducible."""

    message: ClassVar = "Timing"

    time: int
    node: str
    compute_time: int
    missing: list[int] = field(default_factory=list, metadata=bounded(at_most(LIST_LENGTH)))
