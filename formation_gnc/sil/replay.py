"""Flies recorded inputs through parts again: the same parameters give the recorded outputs, bit for bit.

What flew is taken from the bag alone. Parameters are its metadata records `parameters NODE`; changes in
flight are either scheduled there, or are the `/events` of kind `parameters` and are adopted again at their
tick. A part is given an input only where it was given it in the recorded run, which its `timing` tells; one
that had been started again, whose messages are numbered from 1 again, is here too, with the parameters that
it was started with then, `parameters NODE from STAMP`.

The truth is recorded, not flown: changed parts say what they would have commanded, and nothing answers them.
"""

import json
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Configuration, FlightModule
from formation_gnc.flight.synchronizer import StampSynchronizer
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.navigation.navigation_filter import NavigationFilter, NavigationParameters
from formation_gnc.parameters import OWN_OF_ROS, dump, load, to_json
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EstimateStatus, Event, EventKind, Timing
from formation_gnc.sil.runner import Sink
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class Kind:
    """How a part is built, and which of its deputy's topics it hears and fills."""

    schema: type
    build: Callable[[str, Any], Any]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


KINDS = {
    "navigation": Kind(NavigationParameters, NavigationFilter, ("measurement",), ("estimate",)),
    "guidance": Kind(GuidanceParameters, Guidance, ("estimate",), ("target", "separation")),
    "controller": Kind(ControllerParameters, ControllerManager, ("estimate", "target"), ("thrust", "status")),
}

Read = Callable[[str, bytes], Any]
"""The record of a message, given its topic and CDR bytes."""

Copy = Callable[[str, bytes, int], None]
"""Takes what was recorded and is not flown again: topic, CDR bytes, stamp in ns."""


class ReplayedPart:
    """One part, flown again."""

    def __init__(self, node: str, values: Mapping[str, Any]) -> None:
        """Build it from its parameters; raises ConfigurationError for what cannot be flown."""
        self.restarts: dict[int, Any] = {}
        """Parameters by the stamps with whose answers a process began that had been started again."""
        self.node = node
        self.kind = KINDS[node.rpartition("/")[2]]
        self.inputs = [_sibling(node, name) for name in self.kind.inputs]
        self.orphans = 0
        """Ticks whose input the bag lacks though it was answered."""
        self._heard_last = True
        self.start(load(self.kind.schema, values))

    def start(self, parameters: Any) -> None:
        """Begin anew, as a process that was just started with these parameters."""
        self.parameters = parameters
        deputy = self.node.rpartition("/")[0].strip("/")
        fleet = getattr(parameters, "fleet", ())
        self.others = [f"/{name}/estimate" for name in fleet if name != deputy]
        """Inputs that may be missing."""
        self._part: FlightModule[Any, Any] = self.kind.build(self.node, self.parameters)
        self._meeting = StampSynchronizer((*self.inputs, *self.others), len(self.inputs))

    def meet(self, records: Mapping[str, Any]) -> list[Any] | None:
        """Its inputs at a tick, of the records there are by topic; none when it could not answer."""
        inputs = None
        for topic in (*self.others, *reversed(self.inputs)):  # who sets the pace comes last
            if topic in records:
                inputs = self._meeting.take(topic, records[topic])
        return inputs

    def tick(self, time: int, inputs: list[Any], swaps: list[Event]) -> tuple[tuple[Any, ...], list[Event]]:
        """Outputs, none while there is no state, and events of a tick on which `swaps` were recorded."""
        scheduled = [_new_values(pending) for at, pending in self._part.pending if at <= time]
        for swap in swaps:
            changes = {change.name: change.new_value for change in swap.changes}
            if changes in scheduled:
                scheduled.remove(changes)  # the schedule brings it about by itself
            else:
                self._part.commit(self._part.stage({name: json.loads(value) for name, value in changes.items()}))
        answer = self._part.on_tick(*inputs)  # type: ignore[attr-defined]
        records = () if answer is None else answer if isinstance(answer, tuple) else (answer,)
        return records, self._part.take_events()

    def heard(self, time: int, is_heard: bool, recorded: Any) -> bool:
        """Whether to give it this tick's input; starts it again where it had been.

        recorded: its output in the recorded run, if there is one.
        """
        acquired = getattr(recorded, "status", None) == EstimateStatus.ACQUIRED
        if is_heard and (time in self.restarts or (acquired and not self._heard_last)):
            self.start(self.restarts.get(time, self.parameters))
        self._heard_last = is_heard
        return is_heard


def _new_values(scheduled: Configuration[Any, Any]) -> dict[str, str]:
    """Values that a scheduled change brings, by name, as its event will have them."""
    values = dump(scheduled.parameters)
    return {name: to_json(values[name]) for name in scheduled.changes}


def parameters_of(bag: Bag, node: str, start: int | None = None) -> dict[str, Any]:
    """Parameters that a node was started with, as the bag has them; empty when it has none.

    start: stamp (ns) of its first answer after it had been started again; none for its first start.
    """
    recorded = bag.metadata.get(parameters_record(node, start), {})
    return {name: json.loads(text) for name, text in recorded.items() if not name.startswith(OWN_OF_ROS)}


def nodes_of(bag: Bag, kinds: Collection[str]) -> list[str]:
    """Full names of the bag's nodes of the named kinds, in the order in which they answer."""
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown or not kinds:
        raise ConfigurationError(f"nodes {', '.join(unknown) or 'none'}: must be some of {', '.join(KINDS)}")
    deputies = sorted(topic.split("/")[1] for topic in bag.topics if re.fullmatch("/[^/]+/measurement", topic))
    if not deputies:
        raise ConfigurationError(f"{bag.path}: has no measurements to fly again")
    return [f"/{deputy}/{kind}" for kind in KINDS if kind in kinds for deputy in deputies]


def replay(bag: Bag, parameters: Mapping[str, Mapping[str, Any]], read: Read, sink: Sink, copy: Copy) -> list[str]:
    """Fly a bag's inputs through parts again, tick by tick.

    Args:
        bag: the recorded run.
        parameters: of every node to fly again, by full name, in the order of `nodes_of`. Those that are not
            as recorded go before what is recorded at every start.
        read: makes records of messages.
        sink: takes topic and record of all that the parts say.
        copy: takes every other message as it was recorded, sorted by stamp.

    Returns:
        What could not be flown as it was, in words.

    Raises:
        ConfigurationError: parameters that cannot be flown, or a recorded change that these do not allow.
    """
    parts = []
    for node, values in parameters.items():
        if not values:
            raise ConfigurationError(f"{bag.path}: has no parameters of {node}; give them in a file")
        try:
            parts.append(ReplayedPart(node, values))
        except ConfigurationError as error:
            raise ConfigurationError(f"{node}: {error}") from None
    outputs = {_sibling(part.node, output) for part in parts for output in part.kind.outputs}
    answers = {part.node: _sibling(part.node, part.kind.outputs[0]) for part in parts}
    restarts = bag.restarts(list(answers.values()))
    remarks = []
    for part in parts:
        recorded, given, latest = parameters_of(bag, part.node), parameters[part.node], part.parameters
        changes = {name: value for name, value in given.items() if value != recorded.get(name)}
        for stamp in sorted(restarts[answers[part.node]]):
            values = parameters_of(bag, part.node, stamp)
            if values:
                latest = load(part.kind.schema, values | changes)
            else:
                remarks.append(
                    f"{part.node} was started again at {stamp / NANOSECONDS:g} s; the bag lacks with which "
                    "parameters, so it flies with those before"
                )
            part.restarts[stamp] = latest
    tick: dict[str, list[bytes]] = {}
    time = None
    for stamp, topic, messages in bag.by_stamp(list(bag.topics)):
        if stamp != time and time is not None:
            _fly_tick(bag, parts, outputs, time, tick, read, sink, copy)
            tick = {}
        time = stamp
        tick[topic] = messages
    if time is not None:
        _fly_tick(bag, parts, outputs, time, tick, read, sink, copy)
    orphans = sum(part.orphans for part in parts)
    if orphans:
        remarks.append(f"{orphans} answers as recorded, not flown: the bag lacks what they answer")
    return remarks


def _fly_tick(
    bag: Bag,
    parts: list[ReplayedPart],
    outputs: Collection[str],
    time: int,
    tick: Mapping[str, list[bytes]],
    read: Read,
    sink: Sink,
    copy: Copy,
) -> None:
    nodes = {part.node for part in parts}
    swaps: dict[str, list[Event]] = {}
    timed: set[str] = set()
    for topic, messages in tick.items():
        for data in messages:
            if topic == "/events":
                event = read(topic, data)
                if event.node in nodes:
                    if event.kind == EventKind.PARAMETERS:
                        swaps.setdefault(event.node, []).append(event)
                    continue
            elif topic.endswith("/timing"):
                node = _sibling(topic, read(topic, data).node)
                timed.add(node)
                if node in nodes:
                    continue
            if topic not in outputs:
                copy(topic, data, time)
    said: dict[str, Any] = {}
    for part in parts:
        there = {
            topic: said[topic] if topic in outputs else read(topic, tick[topic][-1])
            for topic in (*part.inputs, *part.others)
            if topic in (said if topic in outputs else tick)
        }
        timing = _sibling(part.node, "timing")
        is_timed = timing in bag.topics and bag.topics[timing].count > 0
        output = _sibling(part.node, part.kind.outputs[0])
        recorded = read(output, tick[output][-1]) if output in tick else None
        if _sibling(part.node, "measurement") not in tick:
            continue  # no tick of this deputy
        # A node that was killed in this tick may have answered without the time to say how long it took.
        has_finished = part.node in timed or not is_timed
        is_heard = part.heard(time, has_finished or recorded is not None, recorded)
        inputs = part.meet(there)  # even when it was silent: who is waited for next depends on it
        if inputs is None and recorded is not None:
            # A node that was killed may have reached others with what the recorder never got.
            for topic in (_sibling(part.node, name) for name in part.kind.outputs):
                for data in tick.get(topic, ()):
                    said[topic] = read(topic, data)
                    copy(topic, data, time)
            part.orphans += 1
            continue
        if not is_heard or inputs is None:
            continue
        started = perf_counter()
        records, events = part.tick(time, inputs, swaps.get(part.node, []))
        for name, record in zip(part.kind.outputs, records, strict=False):
            topic = _sibling(part.node, name)
            if record is None or not (has_finished or topic in tick):
                continue
            said[topic] = record
            sink(topic, record)
        if is_timed:
            sink(timing, Timing(time, part.node.rpartition("/")[2], round((perf_counter() - started) * NANOSECONDS)))
        for event in events:
            sink("/events", event)


def _sibling(name: str, other: str) -> str:
    """Full name of what stands beside a node or topic in its deputy's namespace."""
    return f"{name.rpartition('/')[0]}/{other}"
