"""What the parts of the system hand to one another at a tick.

Each class mirrors the message of the same name in ``msg_defs/``, where units and frames are given; `time` is
the message's stamp in nanoseconds of simulated time; `NavigationState` is read from the message of an
`Estimate`, of which it is a part. The core speaks these, the ROS shell translates them.
"""

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

NANOSECONDS = 1_000_000_000


class Sensor(IntEnum):
    """What a reading measures; the constants of Measurement.msg."""

    RADIUS = 0
    RANGE_RATE = 1
    LATITUDE = 2
    RIGHT_ASCENSION = 3
    CHIEF_RANGE = 4


class EstimateStatus(IntEnum):
    """State of the filter; the constants of Estimate.msg."""

    TRACKING = 0
    ACQUIRED = 1
    COASTING = 2
    DIVERGED = 3
    CHIEF_LOST = 4


class Rejection(IntEnum):
    """Why something of a measurement was not used: places in `Estimate.rejections`, its constants."""

    NOT_FINITE = 0
    GATE = 1
    FUTURE = 2
    LATE = 3
    DUPLICATE = 4
    UNKNOWN_SENSOR = 5
    NO_DIRECTION = 6
    OUT_OF_ORDER = 7
    WRONG_DEPUTY = 8
    CHIEF = 9
    AVIONICS = 10
    FIX = 11


Counts = NDArray[np.uint32]
"""A number for every `Rejection`."""


@dataclass(slots=True)
class Measurement:
    """What one deputy knows at a tick before it thinks."""

    time: int
    chief_state: Vector  # (6,)
    sensor: list[int]
    reading: list[float]
    age: list[float]
    applied_force: Vector  # (3,)
    mass: float
    eclipse: bool
    fix_available: bool
    fix: Vector  # (6,)
    deputy: str = ""


@dataclass(slots=True)
class NavigationState:
    """What guidance and control use of an estimate, and all that they read of its message."""

    time: int
    relative_state: Vector  # (6,)
    chief_state: Vector  # (6,)
    mass: float


@dataclass(slots=True)
class Estimate(NavigationState):
    """Relative state of a deputy as its filter knows it."""

    covariance: Matrix = field(metadata={"shape": (6, 6)})
    eclipse: bool
    sensor: list[int]
    innovation: list[float]
    innovation_sigma: list[float]
    nis: float
    status: int
    rejections: Counts = field(default_factory=lambda: np.zeros(len(Rejection), dtype=np.uint32))  # (12,)
    unobservable_direction: Vector = field(default_factory=lambda: np.zeros(6))  # (6,)
    unobservable: str = ""


NO_ECLIPSE: Matrix = np.empty((0, 2))
NOBODY: Matrix = np.empty((0, 6))


@dataclass(slots=True)
class Target:
    """Relative state that a deputy is to have, now and over the horizon."""

    time: int
    formation: str
    relative_state: Vector  # (6,)
    preview_step: float
    preview: Matrix = field(metadata={"shape": (-1, 6)})
    eclipse: Matrix = field(default_factory=lambda: NO_ECLIPSE, metadata={"shape": (-1, 2)})
    others: Matrix = field(default_factory=lambda: NOBODY, metadata={"shape": (-1, 6)})


@dataclass(slots=True)
class Thrust:
    """Force the thrusters are to give until the next tick, Hill frame, N."""

    time: int
    force: Vector  # (3,)


@dataclass(slots=True)
class Status:
    """How the controller came to its command."""

    time: int
    algorithm: str
    demand: Vector  # (3,)
    saturated: list[bool]
    solver: str = ""
    iterations: int = 0
    cost: float = 0.0
    fallback: str = ""


@dataclass(slots=True)
class Separation:
    """How near a deputy will come to the others of its fleet, as far as it can tell."""

    time: int
    planned: float
    planned_time: float
    planned_other: str
    passive: float
    passive_time: float
    passive_other: str


@dataclass(slots=True)
class SatelliteTruth:
    """True state of one deputy."""

    name: str
    inertial_state: Vector  # (6,)
    relative_state: Vector  # (6,)
    applied_force: Vector  # (3,)
    mass: float
    eclipse: bool


@dataclass(slots=True)
class Truth:
    """What really is."""

    time: int
    chief_state: Vector  # (6,)
    deputies: list[SatelliteTruth]


@dataclass(slots=True)
class Event:
    """Something that happened to the run."""

    time: int
    tick: int
    node: str
    kind: str
    detail: str


@dataclass(slots=True)
class Timing:
    """Wall time that a node took for a tick; apart from everything that must be reproducible."""

    time: int
    node: str
    compute_time: float
