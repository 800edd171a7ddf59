"""Reconfigurations: changes of target in flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.flight.module import Configuration, Plan
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.guidance.targets import TargetPath
from formation_gnc.guidance.transfer import LONGEST, shortest_time
from formation_gnc.records import NavigationState
from formation_gnc.types import NANOSECONDS, Vector

type GuidanceConfiguration = Configuration[GuidanceParameters, TargetPath]
type GuidancePlan = Plan[GuidanceParameters, TargetPath]


@dataclass(frozen=True)
class NewTarget:
    """A target that has taken effect and is still to be reported."""

    previous_formation: str = ""
    """Empty at the start of a run."""


class ReconfigurationLock:
    """Excludes changes of target while a reconfiguration with a time limit is under way."""

    def __init__(self) -> None:
        """Unlocked."""
        self._until = 0
        """Time (ns) up to which the target is locked."""

    def begin(self, time: int, duration: float) -> None:
        """Lock the target from a time (ns) for a duration (s)."""
        self._until = _end(time, duration)

    def is_closed(self, time: int) -> bool:
        """Whether the target is locked at a time, ns."""
        return time < self._until

    def check(self, time: int, changes: Mapping[str, Any]) -> None:
        """Raise ConfigurationError for changes of the target at a time (ns) when it is locked."""
        if self.is_closed(time) and not leaves_target(changes):
            raise ConfigurationError(_locked(self._until))

    def check_plan(self, start: GuidanceConfiguration, plan: GuidancePlan) -> None:
        """Raise ConfigurationError for a scheduled change of target before the previous one has had its time."""
        until = self._until
        for (_, old), (time, new) in pairwise([(0, start), *plan]):
            if is_same_target(old, new, time):
                continue
            if time < until:
                raise ParameterError(
                    f"parameter schedule: a change at {time / NANOSECONDS:g} s is not allowed; {_locked(until)}"
                )
            until = _end(time, new.parameters.reconfiguration_time)


def _end(time: int, duration: float) -> int:
    return time + round(duration * NANOSECONDS)


def _locked(until: int) -> str:
    return f"a reconfiguration is under way until {until / NANOSECONDS:g} s; the target stays"


def leaves_target(changes: Mapping[str, Any]) -> bool:
    """Whether changes leave the target as it is, whatever their values."""
    return all(name == "schedule" or name.startswith(("separation_", "safe_")) for name in changes)


def is_same_target(old: GuidanceConfiguration, new: GuidanceConfiguration, time: int) -> bool:
    """Whether a change at a time (ns) keeps the target; where slots are assigned, that of the whole fleet."""
    if new.parameters.assignment != "fixed":
        return leaves_target(new.changes)
    now = np.array([time / NANOSECONDS])
    return np.array_equal(old.design.states(now), new.design.states(now))


@dataclass(frozen=True)
class Transfer:
    """The way from a satellite's state to a new target."""

    distance: float
    """m."""
    shortest_time: float
    """That the thrusters allow, s; infinite beyond `LONGEST` revolutions."""
    is_feasible: bool
    """Whether the reconfiguration time is enough."""

    def __str__(self) -> str:
        """As the text of an event."""
        time = self.shortest_time
        words = f"{time:.0f} s" if math.isfinite(time) else f"more than {LONGEST} revolutions"
        return f"{self.distance:.0f} m to go, shortest time {words}"


@np.errstate(all="ignore")  # an estimate may be as large as a float
def transfer_to(target: Vector, estimate: NavigationState, parameters: GuidanceParameters) -> Transfer | None:
    """The transfer from an estimate to a target (6,); None for an estimate that is not finite, or has no mass."""
    error = estimate.relative_state - target
    if not (np.isfinite(error).all() and estimate.mass > 0.0):
        return None
    acceleration = np.array(parameters.thrust_limit) / estimate.mass
    soonest = shortest_time(error, acceleration, parameters.mean_motion)
    is_feasible = not 0.0 < parameters.reconfiguration_time < soonest
    return Transfer(float(np.linalg.norm(error[:3])), soonest, is_feasible)
