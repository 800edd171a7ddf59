"""The fault table: which verdicts lead to which responses, as data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatchcase
from typing import Any

import yaml

from formation_gnc.errors import ParameterError, nearest
from formation_gnc.mode_records import CHIEF
from formation_gnc.parameters import read_yaml
from formation_gnc.supervision.modes import FAULTS, TRANSITIONS, Mode

FOREVER = 0
"""Value of `return` for a response that only a command ends."""


class Response(StrEnum):
    """What a fault is answered with."""

    WARN = "warn"
    ISOLATE_SENSOR = "isolate_sensor"
    """Navigation goes on without the sensor that is the subject, or without the chief's ephemeris."""
    ISOLATE_AXIS = "isolate_axis"
    """The controller does without the axis that is the subject."""
    SWITCH_LAW = "switch_law"
    """The next of the laws in `laws` that is not in use."""
    GO_TO = "go_to"
    """Mode `mode`."""


ABOUT = {Response.ISOLATE_SENSOR: "sensor", Response.ISOLATE_AXIS: "axis"}
"""What the subject of a response must be."""


@dataclass(frozen=True)
class Entry:
    """A line of the fault table."""

    monitor: str
    subject: str
    """Pattern of subjects, such as `radius` or `*`."""
    persistence: int
    """Ticks for which a verdict must have failed."""
    response: Response
    mode: Mode | None
    """Of `go_to`."""
    laws: tuple[str, ...]
    """Of `switch_law`, in the order in which they are tried."""
    returns: int
    """Ticks without the fault after which the response ends; `FOREVER` for none."""
    modes: frozenset[Mode]
    """In which it holds; elsewhere it is a warning."""

    def matches(self, monitor: str, subject: str) -> bool:
        """Whether a verdict on a subject is for this line."""
        return monitor == self.monitor and fnmatchcase(subject, self.subject)


DEFAULT = (
    "{monitor: innovation_bias, persistence: 1, response: isolate_sensor, return: 600}",
    "{monitor: innovation_drift, persistence: 1, response: isolate_sensor, return: 600}",
    "{monitor: frozen_readings, persistence: 1, response: isolate_sensor, return: 600}",
    "{monitor: dropout, persistence: 1, response: warn, return: 1}",
    "{monitor: innovation_consistency, persistence: 1, response: warn, return: 60}",
    "{monitor: covariance, persistence: 600, response: go_to, mode: safe, modes: [keep, reconfigure]}",
    "{monitor: estimate_jump, persistence: 1, response: go_to, mode: acquire, return: 60, modes: [keep, reconfigure]}",
    "{monitor: frozen_estimate, persistence: 1, response: go_to, mode: safe}",
    "{monitor: chief_ephemeris, persistence: 1, response: isolate_sensor, return: 600}",
    "{monitor: thrust_response, persistence: 1, response: isolate_axis}",
    "{monitor: thruster_on, persistence: 1, response: warn, return: 60}",
    "{monitor: mass, persistence: 1, response: warn, return: 60}",
    "{monitor: control_error, persistence: 60, response: go_to, mode: safe, modes: [keep, acquire]}",
    "{monitor: saturation, persistence: 1, response: warn, return: 60}",
    "{monitor: solver_fallback, persistence: 1, response: switch_law, laws: [lqr, coast]}",
    "{monitor: residual_acceleration, persistence: 1, response: warn, return: 60}",
    "{monitor: propellant, persistence: 1, response: warn, return: 60}",
    "{monitor: separation, subject: planned, persistence: 1, response: go_to, mode: avoid, return: 60}",
    "{monitor: separation, subject: passive, persistence: 1, response: warn, return: 60}",
    "{monitor: neighbours, persistence: 1, response: warn, return: 60}",
    "{monitor: heartbeat, persistence: 1, response: warn, return: 60}",
    "{monitor: cycle_slips, persistence: 1, response: warn, return: 60}",
)
"""Sensors and axes that can be told apart are taken out; what cannot be trusted or held ends in `safe`."""

EXAMPLE = "{monitor: innovation_bias, subject: radius, persistence: 3, response: isolate_sensor, return: 600}"

_KEYS = ("monitor", "subject", "persistence", "response", "mode", "laws", "return", "modes")


def parse(
    entries: Sequence[str],
    subjects: Mapping[str, Sequence[str]],
    sensors: Sequence[str],
    axes: Sequence[str],
    laws: Sequence[str] = (),
) -> tuple[Entry, ...]:
    """The fault table of a parameter.

    Args:
        entries: one line each, as text in YAML.
        subjects: what each monitor's verdicts may be about, by monitor.
        sensors: their names.
        axes: their names.
        laws: names of all control laws; none where they are not known, and not checked.

    Raises:
        ParameterError: a line that is not of the form, names what there is not, or cannot be carried out.
    """
    return tuple(_Parser(entry, subjects, sensors, axes, laws).parse() for entry in entries)


@dataclass(frozen=True)
class _Parser:
    """Parser of one line, with what it may name."""

    entry: str
    subjects: Mapping[str, Sequence[str]]
    sensors: Sequence[str]
    axes: Sequence[str]
    laws: Sequence[str]

    def rejection(self, reason: str) -> ParameterError:
        return ParameterError(f"parameter fault_table: {self.entry!r} is not allowed; {reason}")

    def parse(self) -> Entry:
        """The line; raises ParameterError."""
        try:
            values = read_yaml(self.entry)
        except yaml.YAMLError:
            values = None
        if not isinstance(values, dict) or not {"monitor", "response"} <= values.keys():
            raise self.rejection(f"it must be like {EXAMPLE!r}, with one of the responses {', '.join(Response)}")
        for key in values:
            if key not in _KEYS:
                raise self.rejection(f"{key} is unknown; {nearest(str(key), _KEYS)}")
        monitor = self.named("monitor", values["monitor"], self.subjects)
        response = Response(self.named("response", values["response"], tuple(Response)))
        mode = self.mode(response, values)
        return Entry(
            monitor,
            self.subject(monitor, str(values.get("subject", "*")), response),
            self.count("persistence", values.get("persistence", 1), 1),
            response,
            mode,
            self.order(response, values),
            self.count("return", values.get("return", FOREVER), FOREVER),
            self.modes(mode, values),
        )

    def named(self, what: str, value: Any, known: Sequence[str] | Mapping[str, Any]) -> str:
        if value not in known:
            raise self.rejection(f"{what} {value} is unknown; {nearest(str(value), known)}")
        return str(value)

    def count(self, what: str, value: Any, least: int) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value < 2**31:
            raise self.rejection(f"{what} is {value!r}; it must be a number of ticks, at least {least}")
        return value

    def subject(self, monitor: str, pattern: str, response: Response) -> str:
        known = self.subjects[monitor]
        about = {"sensor": (*self.sensors, CHIEF), "axis": self.axes}.get(ABOUT.get(response, ""))
        if about is not None and not set(known) <= set(about):
            raise self.rejection(
                f"{response} needs a monitor of each {ABOUT[response]}; {monitor} is about something else"
            )
        # A sensor that exists and is not in use is no mistake: its line waits until it is.
        every = (*known, *self.sensors) if set(known) <= set(self.sensors) else known
        if not any(fnmatchcase(each, pattern) for each in every):
            raise self.rejection(f"{monitor} says nothing about {pattern}; {nearest(pattern, filter(None, every))}")
        return pattern

    def mode(self, response: Response, values: Mapping[str, Any]) -> Mode | None:
        if response is not Response.GO_TO:
            if "mode" in values:
                raise self.rejection(f"mode is for go_to; {response} has none")
            return None
        mode = Mode(self.named("mode", values.get("mode"), tuple(Mode)))
        if mode not in FAULTS:
            raise self.rejection(f"a fault does not lead to {mode}; it may lead to {', '.join(FAULTS)}")
        return mode

    def order(self, response: Response, values: Mapping[str, Any]) -> tuple[str, ...]:
        if response is not Response.SWITCH_LAW:
            if "laws" in values:
                raise self.rejection(f"laws are for switch_law; {response} has none")
            return ()
        laws = values.get("laws")
        if not isinstance(laws, list) or not laws or len(set(map(str, laws))) != len(laws):
            raise self.rejection("switch_law needs laws, a list of different ones in the order in which they are tried")
        return tuple(self.named("law", each, self.laws) if self.laws else str(each) for each in laws)

    def modes(self, target: Mode | None, values: Mapping[str, Any]) -> frozenset[Mode]:
        possible = [mode for mode in Mode if target is None or (mode, FAULTS[target]) in TRANSITIONS]
        given = values.get("modes")
        if given is None:
            return frozenset(possible)
        if not isinstance(given, list) or not given:
            raise self.rejection("modes must be a list of modes in which the line holds")
        modes = [Mode(self.named("mode", each, tuple(Mode))) for each in given]
        for each in modes:
            if each not in possible:
                raise self.rejection(f"a fault does not lead from {each} to {target}: {each} stays in force")
        return frozenset(modes)


def table_of(entries: Sequence[Entry]) -> str:
    """Markdown table of a fault table."""
    lines = [
        "| monitor | subject | persistence, ticks | response | in modes | returns after, ticks |",
        "|---|---|---|---|---|---|",
    ]
    for entry in entries:
        words = " ".join(filter(None, [entry.response, entry.mode or "", ", ".join(entry.laws)]))
        modes = "all" if len(entry.modes) == len(Mode) else ", ".join(each for each in Mode if each in entry.modes)
        returns = "by command" if entry.returns == FOREVER else str(entry.returns)
        lines.append(f"| `{entry.monitor}` | {entry.subject} | {entry.persistence} | {words} | {modes} | {returns} |")
    return "\n".join(lines).replace("| * |", "| any |")
