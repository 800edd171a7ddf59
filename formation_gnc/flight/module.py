"""Flight modules: navigation, guidance and control, with parameters that change in flight at a tick."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from formation_gnc.common import CommonParameters
from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.flight.schedule import parse_schedule
from formation_gnc.parameters import change, change_in_words, differences, dump, parameter, to_json
from formation_gnc.records import Event, EventKind, ParameterChange
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class ModuleParameters(CommonParameters):
    """Parameters of a flight module."""

    schedule: tuple[str, ...] = parameter(
        (),
        in_flight=True,
        doc="changes in flight, each `{at: SECONDS, PARAMETER: VALUE, ...}`, effective at the first tick at or "
        "after its time; a new schedule may keep past entries, and the entries it adds must be in the future",
    )


@dataclass(frozen=True)
class Configuration[P, D]:
    """Parameters and the design made from them."""

    parameters: P
    design: D
    changes: Mapping[str, Any]
    """New values, by name, that led to these parameters."""
    plan: "Plan[P, D]" = ()
    """The scheduled configurations, where `changes` sets the schedule."""


@dataclass(frozen=True)
class Condition:
    """How something that a module watches is doing, for diagnostics."""

    name: str
    level: int
    """0 for well, 1 for a warning, 2 for an error."""
    message: str
    values: Mapping[str, Any]


type Plan[P, D] = tuple[tuple[int, Configuration[P, D]], ...]
"""Scheduled configurations with the times (ns) from which they hold, in order of time."""


class FlightModule[P: ModuleParameters, D](ABC):
    """A GNC module of one deputy: parameters, the design made from them, and changes of both in flight.

    A change has two steps. `stage` validates it and makes the new design; it may be slow, has no effect and
    may run in another thread. `commit` queues the result, which takes effect when the next tick begins.

    A subclass has `design`, and an `on_tick` that calls `begin_tick` first. Where it needs them, it overrides
    `reset`, `activate`, and the vetoes `check_staged`, `check_due` and `check_plan`.
    """

    neighbours: tuple[str, ...] = ()
    """Names of the fleet's other satellites whose outputs it takes."""
    time: int
    """Stamp of the current tick, ns."""
    configuration: Configuration[P, D]
    """The configuration in force."""
    pending: Plan[P, D]
    """The scheduled configurations that are not in force yet."""

    def __init__(self, name: str, parameters: P) -> None:
        """Design for `parameters` and for every change they schedule; `name` is the node's full name.

        Raises:
            ConfigurationError: a design fails, or a scheduled change is not allowed.
        """
        self.name = name
        self.events: list[Event] = []
        self._initial, self._kept = parameters, dict[str, Any]()
        self._committed = deque[Configuration[P, D]]()
        self._begin_run()

    @abstractmethod
    def design(self, parameters: P) -> D:
        """The design for these parameters; raises ConfigurationError when there is none."""

    def reset(self) -> None:  # noqa: B027 - optional
        """Clear the state kept between ticks; called at the start of every run, before its schedule is planned."""

    @abstractmethod
    def on_tick(self, *args: Any, **kwargs: Any) -> Any:
        """Answer a tick: from the inputs of one stamp to the outputs, as the graph table lists both.

        Returns the record of the only output, or a tuple with one for each; None for an output that there is not.
        """

    def activate(self, old: Configuration[P, D], new: Configuration[P, D]) -> None:  # noqa: B027 - optional
        """Hand over the state of the old design to the new one; called at the tick of the change."""

    def check_staged(self, staged: Configuration[P, D]) -> None:  # noqa: B027 - optional
        """Raise ConfigurationError for a change that may not be made in flight now; called by `stage`."""

    def check_due(self, time: int, due: Configuration[P, D]) -> None:  # noqa: B027 - optional
        """Raise ConfigurationError for a change that may not take effect at the tick at `time` (ns)."""

    def check_plan(self, start: Configuration[P, D], plan: Plan[P, D]) -> None:  # noqa: B027 - optional
        """Raise ConfigurationError for scheduled changes that may not follow one another, or `start`."""

    def has_delayed_inputs(self, pacing: Any) -> bool:
        """Whether its inputs of the tick before are there, or on their way; by the record of its first input."""
        return True

    def first_of(self, waiting: Sequence[Any]) -> Any:
        """Where to go on among inputs that wait: by default with the last, since the others are too late."""
        return waiting[-1]

    def conditions(self) -> Sequence[Condition]:
        """What it watches besides itself, for diagnostics; called now and then."""
        return ()

    @property
    def waiting_for(self) -> str:
        """What it lacks to answer, in words; empty for nothing."""
        return ""

    @property
    def parameters(self) -> P:
        """The parameters in force."""
        return self.configuration.parameters

    def derive(self, parameters: P, changes: Mapping[str, Any]) -> Configuration[P, D]:
        """The configuration for changed parameters, with the plan of a changed schedule; has no effect.

        Raises:
            ConfigurationError: the change is not allowed, or a design fails.
        """
        changed = change(parameters, changes)
        configuration = Configuration(changed, self.design(changed), dict(changes))
        if "schedule" not in changes:
            return configuration
        return replace(configuration, plan=self._plan(configuration, self.time))

    def stage(self, changes: Mapping[str, Any]) -> Configuration[P, D]:
        """Validate a change of parameters and design for it, without effect yet.

        A change to the values that hold, or wait to, is no change: nothing is designed, and `commit` does nothing.

        Raises:
            ConfigurationError: the change is not allowed, or the design fails; nothing has changed.
        """
        waiting = tuple(self._committed)
        latest = waiting[-1] if waiting else self.configuration
        effective = differences(latest.parameters, change(latest.parameters, changes))
        if not effective:
            return replace(latest, changes={}, plan=())
        staged = self.derive(self.parameters, {**waiting[-1].changes, **effective} if waiting else effective)
        self.check_staged(staged)
        return staged

    def commit(self, staged: Configuration[P, D]) -> None:
        """Queue a staged configuration, to take effect when the next tick begins."""
        if staged.changes:
            self._committed.append(staged)

    def begin_tick(self, time: int) -> None:
        """Make the changes due at `time` (ns): scheduled ones, then committed ones.

        Time that runs backwards starts a new run, with the schedule of the start. Committed changes are kept
        in it, unless that schedule is not allowed together with them.
        """
        if time < self.time:
            try:
                self._begin_run()
            except ConfigurationError as rejection:
                self._kept.clear()
                self._begin_run()
                self.log(time, EventKind.REJECTED, str(rejection))
        self.time = time
        while self.pending and self.pending[0][0] <= time:
            (_, due), *later = self.pending
            self.pending = tuple(later)
            self._apply(time, due)
        while self._committed:
            committed = self._committed.popleft()
            if self._apply(time, committed):
                self._kept |= committed.changes

    def log(
        self,
        time: int,
        kind: EventKind,
        detail: str = "",
        subject: str = "",
        changes: Iterable[ParameterChange] = (),
    ) -> None:
        """Log an event, to be published with the tick's output.

        Args:
            time: from which it holds, ns.
            kind: what happened.
            detail: one line for people; nothing is read from it.
            subject: what it is about, such as a law, sensor or formation.
            changes: of parameters.
        """
        tick = time // self.parameters.tick_ns
        self.events.append(Event(time, tick, self.name, kind, subject, list(changes), detail))

    def scheduled_changes(self, time: int) -> list[dict[str, str]]:
        """New values by name, as their events will have them, of the scheduled changes due by a time (ns)."""
        due = [configuration for at, configuration in self.pending if at <= time]
        after = [dump(each.parameters) for each in due]
        return [{name: to_json(values[name]) for name in each.changes} for each, values in zip(due, after, strict=True)]

    def take_events(self) -> list[Event]:
        """The events logged since the last call."""
        events, self.events = self.events, []
        return events

    def _begin_run(self) -> None:
        parameters = change(self._initial, self._kept)
        self.time = 0
        self.configuration = Configuration(parameters, self.design(parameters), {})
        self.reset()
        self.pending = self._plan(self.configuration, -math.inf)

    def _plan(self, start: Configuration[P, D], now: float) -> Plan[P, D]:
        """Design for the schedule of `start` after a time (ns), one change on top of the other.

        Raises:
            ConfigurationError: a scheduled change is not allowed, or is neither in the future nor in the
                schedule in force.
        """
        planned, latest = [], start
        for each in parse_schedule(start.parameters.schedule):
            if each.time > now:
                latest = self.derive(latest.parameters, each.changes)
                planned.append((each.time, latest))
            elif each.entry not in self.parameters.schedule:
                raise ParameterError(
                    f"parameter schedule: {each.entry!r} is not allowed; its time must be above "
                    f"{now / NANOSECONDS:g} s, which is now"
                )
        plan = tuple(planned)
        self.check_plan(start, plan)
        return plan

    def _apply(self, time: int, due: Configuration[P, D]) -> bool:
        """Make a change at a tick, or log its rejection; returns whether its values hold."""
        try:
            changed = change(self.parameters, due.changes)
            if changed == self.parameters:
                return True
            self.check_due(time, due)
            # The design made in advance holds only if nothing else has changed since.
            if changed != due.parameters or any(at <= time for at, _ in due.plan):
                due = self.derive(self.parameters, due.changes)
        except ConfigurationError as rejection:
            self.log(time, EventKind.REJECTED, str(rejection))
            return False
        self._swap(time, due)
        return True

    def _swap(self, time: int, new: Configuration[P, D]) -> None:
        old, self.configuration = self.configuration, new
        if "schedule" in new.changes:
            self.pending = new.plan
        self.activate(old, new)
        changes, detail = change_in_words(old.parameters, new.parameters)
        self.log(time, EventKind.PARAMETERS, detail, changes=changes)
