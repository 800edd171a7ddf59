"""Records that supervision gives at every tick."""

from dataclasses import dataclass
from typing import ClassVar

from formation_gnc.records import Record


@dataclass(slots=True)
class ModeState(Record):
    """Mode of a satellite, decided at its stamp and in force from the next tick on."""

    message: ClassVar = "ModeState"

    time: int
    mode: str  # Mode
    previous: str  # Mode
    reason: str
    """Trigger and fault that led to it; empty while it stays."""


@dataclass(slots=True)
class MonitorStatus(Record):
    """Verdict of a monitor on a subject."""

    message: ClassVar = "MonitorStatus"

    monitor: str
    subject: str
    level: int  # Level
    statistic: float
    threshold: float


@dataclass(slots=True)
class HealthReport(Record):
    """Health of a satellite: what is suspect or has failed, and the responses in force."""

    message: ClassVar = "Health"

    time: int
    statuses: list[MonitorStatus]
    """Those that are not well."""
    isolated_sensors: list[str]
    isolated_axes: list[str]
    laws: list[str]
    """In the order in which they are to be tried; empty for the law that is configured."""
