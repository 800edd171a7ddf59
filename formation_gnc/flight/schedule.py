"""Schedules: changes of parameters planned for given times, written as text."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from formation_gnc.errors import ParameterError
from formation_gnc.parameters import read_yaml
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class ScheduledChange:
    """One entry of a schedule."""

    entry: str
    """The entry as written."""
    time: int
    """Time from which it holds, ns."""
    changes: dict[str, Any]
    """New values by parameter name."""


def parse_schedule(entries: Sequence[str]) -> list[ScheduledChange]:
    """The changes of a schedule by time; entries of one time keep their order.

    Raises:
        ParameterError: an entry is not of the form `{at: SECONDS, PARAMETER: VALUE, ...}`, or changes the
            schedule.
    """
    return sorted(map(_parse, entries), key=lambda change: change.time)


def _parse(entry: str) -> ScheduledChange:
    try:
        changes = read_yaml(entry)
        time = round(float(changes.pop("at")) * NANOSECONDS)
    except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"parameter schedule: {entry!r} is not allowed; "
            "it must be like '{at: 3000.0, algorithm: coast}' with the time in seconds"
        ) from None
    if "schedule" in changes:
        raise ParameterError(f"parameter schedule: {entry!r} is not allowed; it must not change itself")
    return ScheduledChange(entry, time, {str(name): value for name, value in changes.items()})
