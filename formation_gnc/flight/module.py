"""A part of a satellite's software whose parameters change in flight, at a tick."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import yaml

from formation_gnc.common import CommonParameters
from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.parameters import change, dump, parameter, read_yaml, to_json
from formation_gnc.records import Event, EventKind, ParameterChange
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class ModuleParameters(CommonParameters):
    """Parameters of a part, and changes of them foreseen for given times."""

    schedule: tuple[str, ...] = parameter(
        (),
        in_flight=True,
        doc="changes in flight, each `{at: SECONDS, PARAMETER: VALUE, ...}`, taking effect at the first tick "
        "from then on; a new schedule may keep entries that are over, and what it adds must be to come",
    )


@dataclass(frozen=True)
class Configuration[P, D]:
    """Parameters together with what was designed from them."""

    parameters: P
    design: D
    changes: Mapping[str, Any]
    plan: "Plan[P, D]" = ()
    """What its schedule brings, if that is one of the changes."""


type Plan[P, D] = tuple[tuple[int, Configuration[P, D]], ...]
"""Configurations and the times (ns) from which they are to hold, in order."""


class FlightModule[P: ModuleParameters, D](ABC):
    """Navigation, guidance or control of one deputy: parameters, what is designed from them, and swaps.

    A change goes in two steps. `stage` checks it and designs, which may be slow, touches nothing and may
    run in another thread; `commit` hands the result over, and it takes effect when the next tick begins.
    """

    neighbours: tuple[str, ...] = ()
    """Names of the fleet's other satellites whose outputs it takes."""

    def __init__(self, name: str, parameters: P) -> None:
        """Design from `parameters` and from every change they schedule; `name` is the node's full name.

        Raises:
            ConfigurationError: a design fails, or a scheduled change is not allowed.
        """
        self.name = name
        self.events: list[Event] = []
        self._given, self._changes = parameters, dict[str, Any]()
        self._adopted = deque[Configuration[P, D]]()
        self._start()

    def _start(self) -> None:
        parameters = change(self._given, self._changes)
        self._time = 0
        self.configuration: Configuration[P, D] = Configuration(parameters, self.design(parameters), {})
        self.foreseen: Plan[P, D] = self._plan(self.configuration, -math.inf)
        """What is scheduled and still to come."""
        self.reset()

    def reset(self) -> None:  # noqa: B027 - optional
        """Start without a memory of earlier ticks; called before the first tick of every run."""

    @abstractmethod
    def design(self, parameters: P) -> D:
        """What flies with these parameters; raises ConfigurationError when nothing can."""

    @abstractmethod
    def on_tick(self, *args: Any, **kwargs: Any) -> Any:
        """Answer a tick: from the inputs of one stamp to the outputs, as the graph table lists both.

        Returns the record of the only output, or a tuple with one for each; None for an output that there is not.
        """

    def activate(self, old: Configuration[P, D], new: Configuration[P, D]) -> None:  # noqa: B027 - optional
        """Hand the state of the old design to the new one; called at the tick where it takes over."""

    @property
    def parameters(self) -> P:
        """The parameters in force."""
        return self.configuration.parameters

    def stage(self, changes: Mapping[str, Any]) -> Configuration[P, D]:
        """Check a change of parameters and design from it, without effect yet.

        Raises:
            ConfigurationError: the change is not allowed, or the design fails; nothing has changed.
        """
        waiting = tuple(self._adopted)
        return self._design_from(self.parameters, {**waiting[-1].changes, **changes} if waiting else changes)

    def _design_from(self, parameters: P, changes: Mapping[str, Any]) -> Configuration[P, D]:
        changed = change(parameters, changes)
        configuration = Configuration(changed, self.design(changed), dict(changes))
        if "schedule" not in changes:
            return configuration
        return replace(configuration, plan=self._plan(configuration, self._time))

    def _plan(self, start: Configuration[P, D], over: float) -> Plan[P, D]:
        """What the schedule of `start` brings after a time (ns), designed in turn.

        Raises:
            ConfigurationError: what it brings is not allowed, or is to come before that time and does not
                stand in the schedule in force.
        """
        plan, latest = [], start
        for entry in sorted(start.parameters.schedule, key=lambda entry: scheduled(entry)[0]):
            at, changes = scheduled(entry)
            if at > over:
                latest = self._design_from(latest.parameters, changes)
                plan.append((at, latest))
            elif entry not in self.parameters.schedule:
                raise ParameterError(
                    f"parameter schedule: {entry!r} is not allowed; its time must be above "
                    f"{over / NANOSECONDS:g} s, which is now"
                )
        return tuple(plan)

    def commit(self, prepared: Configuration[P, D]) -> None:
        """Let a prepared configuration take over when the next tick begins."""
        self._adopted.append(prepared)

    def begin_tick(self, time: int) -> None:
        """Let a change take over that is due at this tick: first a scheduled one, then an adopted one.

        Time that runs backwards is a new run: what the schedule has changed is as it was at the start, what
        was adopted stays, unless the schedule does not go with it from the start.
        """
        if time < self._time:
            try:
                self._start()
            except ConfigurationError as rejection:
                self._changes.clear()
                self._start()
                self.log(time, EventKind.REJECTED, str(rejection))
        self._time = time
        while self.foreseen and self.foreseen[0][0] <= time:
            (_, due), *later = self.foreseen
            self.foreseen = tuple(later)
            self._let_take_over(time, due)
        while self._adopted:
            adopted = self._adopted.popleft()
            if self._let_take_over(time, adopted):
                self._changes |= adopted.changes

    def _let_take_over(self, time: int, due: Configuration[P, D]) -> bool:
        """Swap, if that is still allowed."""
        try:
            # What was designed beforehand holds only if nothing else has changed since.
            changed = change(self.parameters, due.changes)
            if changed != due.parameters or any(at <= time for at, _ in due.plan):
                due = self._design_from(self.parameters, due.changes)
        except ConfigurationError as rejection:  # only now, together with what was changed since it was prepared
            self.log(time, EventKind.REJECTED, str(rejection))
            return False
        self._swap(time, due)
        return True

    def _swap(self, time: int, new: Configuration[P, D]) -> None:
        old, self.configuration = self.configuration, new
        if "schedule" in new.changes:
            self.foreseen = new.plan
        self.activate(old, new)
        before, after = dump(old.parameters), dump(new.parameters)
        changes = [ParameterChange(name, to_json(before[name]), to_json(after[name])) for name in new.changes]
        detail = ", ".join(f"{name}: {_text(before[name])} -> {_text(after[name])}" for name in new.changes)
        self.log(time, EventKind.PARAMETERS, detail, changes=changes)

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
        due = [configuration for at, configuration in self.foreseen if at <= time]
        after = [dump(each.parameters) for each in due]
        return [{name: to_json(values[name]) for name in each.changes} for each, values in zip(due, after, strict=True)]

    def take_events(self) -> list[Event]:
        """The events noted since they were last taken."""
        events, self.events = self.events, []
        return events


def scheduled(entry: str) -> tuple[int, dict[str, Any]]:
    """Time (ns) and changes of one entry of a schedule; raises ParameterError when it cannot be read."""
    try:
        changes = read_yaml(entry)
        at = round(float(changes.pop("at")) * NANOSECONDS)
    except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"parameter schedule: {entry!r} is not allowed; "
            "it must be like '{at: 3000.0, algorithm: coast}' with the time in seconds"
        ) from None
    if "schedule" in changes:
        raise ParameterError(f"parameter schedule: {entry!r} is not allowed; it must not change itself")
    return at, {str(name): value for name, value in changes.items()}


def _text(value: Any) -> str:
    return value if isinstance(value, str) else to_json(value)
