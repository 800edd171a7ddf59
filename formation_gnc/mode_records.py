"""Records that a supervisor gives: modes, what modules do without, health."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar

import numpy as np

from formation_gnc.bounds import among, at_most, bounded, each
from formation_gnc.records import LIST_LENGTH, NAME_LENGTH, Record
from formation_gnc.types import Vector


class Mode(StrEnum):
    """What a satellite is doing; the constants of ModeState.msg."""

    STANDBY = "standby"
    """No thrust, by command; nothing but a command or a fault ends it."""
    ACQUIRE = "acquire"
    """On its way to the target, or waiting for a state."""
    KEEP = "keep"
    """Control error within the tube."""
    RECONFIGURE = "reconfigure"
    """On a transfer that guidance has begun."""
    AVOID = "avoid"
    """Evading, since a predicted separation is below its limit."""
    SAFE = "safe"
    """On, or on its way to, an orbit that is safe without thrust; left by command alone."""


class RestrictionKind(StrEnum):
    """What a module does without; the constants of Restriction.msg."""

    SENSOR = "sensor"
    AXIS = "axis"
    LAW = "law"


CHIEF, STATE = "chief", "state"
"""What navigation may have to do without besides sensors, as restrictions of that kind: the chief's ephemeris, which it
propagates itself then, and its own state, which it acquires anew."""

NO_FORCE: Vector = np.zeros(3)
NO_FORCE.setflags(write=False)


@dataclass(slots=True)
class Restriction(Record):
    """What a module has to do without, since it is at fault."""

    message: ClassVar = "Restriction"

    kind: str = field(metadata=bounded(among(RestrictionKind)))
    subject: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    reason: str = field(metadata=bounded(at_most(NAME_LENGTH)))


@dataclass(slots=True)
class ModeState(Record):
    """Mode of a satellite, decided at its stamp and in force from the next tick on."""

    message: ClassVar = "ModeState"
    frame_id: ClassVar = "hill"

    time: int
    mode: str = field(metadata=bounded(among(Mode)))
    previous: str = field(metadata=bounded(among(Mode)))
    since: int
    reason: str = field(default="", metadata=bounded(at_most(NAME_LENGTH)))
    force: Vector = field(default_factory=lambda: NO_FORCE)  # (3,)
    restrictions: list[Restriction] = field(default_factory=list, metadata=bounded(each(LIST_LENGTH)))


@dataclass(slots=True)
class MonitorStatus(Record):
    """Verdict of a health monitor on a subject."""

    message: ClassVar = "MonitorStatus"

    monitor: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    subject: str = field(metadata=bounded(at_most(NAME_LENGTH)))
    level: int  # Level
    statistic: float
    threshold: float


@dataclass(slots=True)
class HealthReport(Record):
    """Health of a satellite: the verdicts that are not well."""

    message: ClassVar = "Health"

    time: int
    statuses: list[MonitorStatus] = field(metadata=bounded(each(LIST_LENGTH)))
