"""Starts of the modules of a recorded run: when, and with what parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES, modules_named
from formation_gnc.parameters import OWN_OF_ROS, from_json
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EventKind, ParameterChange, Timing

CHANGES = frozenset({EventKind.PARAMETERS, EventKind.ASSIGNMENT, EventKind.MODE})
"""Kinds of events by which a node changes its own parameters."""

Decode = Callable[[str, bytes], Any]
"""The record of a message, given its topic and CDR bytes; None for one that no module takes."""


@dataclass(frozen=True)
class Start:
    """One start of a node."""

    stamp: int
    """Of its first tick, ns; 0 for the first start."""
    answer: int | None
    """Stamp of its first answer, ns; None for the first start."""
    values: Mapping[str, Any]
    """Parameters by name; empty where the bag has none."""


def starts_of(
    bag: Bag, nodes: Sequence[str], decode: Decode, overrides: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, list[Start]]:
    """Every start of nodes, by their full names, each list sorted and with the first start at its head.

    A recorder asks for parameters when it has heard a node answer; some may have changed by then. The event of such a
    change has the value before it, which is that of the start.

    overrides: parameters of nodes that are not as they were, at any start whose parameters the bag has, and the first.

    Raises:
        ConfigurationError: recorded values that are no JSON.
    """
    answers = {node: MODULES[node_name(node)].answer.of(topics.deputy_of(node)) for node in nodes}
    timings = {topics.TIMING.of(topics.deputy_of(node)) for node in nodes}
    restarts = bag.restarts(
        [*answers.values(), *sorted(timings)],
        lambda topic, data: timed_node(topic, decode(topic, data)) if topic in timings else topic,
    )
    changes = _changes(bag, decode)
    found: dict[str, list[Start]] = {}
    for node in nodes:
        begun: list[tuple[int, int | None]] = [(0, None)]
        before = -1
        for restart in sorted(restarts[answers[node]]):
            # Its first ticks may have had no answer: navigation without a fix to start from.
            own = [stamp for stamp in restarts.get(node, ()) if before < stamp <= restart]
            begun.append((max(own, default=restart), restart))
            before = restart
        ends = [stamp for stamp, _ in begun[1:]] + [2**64]
        found[node] = []
        for (stamp, answer), end in zip(begun, ends, strict=True):
            values = _values(bag, node, answer, _first(changes.get(node, ()), stamp, end))
            if values or not found[node]:
                values |= (overrides or {}).get(node, {})
            found[node].append(Start(stamp, answer, values))
    return found


def nodes_of(bag: Bag, modules: Sequence[str]) -> list[str]:
    """Full names of the bag's nodes of the named modules, in the order in which they answer."""
    rows, deputies = modules_named(modules), topics.deputies_in(bag.topics)
    if not deputies:
        raise ConfigurationError(f"{bag.path}: has no measurements to replay")
    return [f"/{deputy}/{row.name}" for row in rows for deputy in deputies]


def node_name(node: str) -> str:
    """Name of a node's module in the graph table."""
    return node.rpartition("/")[2]


def timed_node(topic: str, timing: Timing | None) -> str:
    """Full name of the node that a timing is of."""
    return f"/{topics.deputy_of(topic)}/{timing.node if timing else ''}"


def _changes(bag: Bag, decode: Decode) -> dict[str, list[tuple[int, ParameterChange]]]:
    """Changes of parameters in flight by node, with their stamps (ns), in the order in which they were made."""
    found: dict[str, list[tuple[int, ParameterChange]]] = {}
    recorded = bag.messages([topics.EVENTS.name]) if topics.EVENTS.name in bag.topics else ()
    for topic, data, stamp in sorted(recorded, key=itemgetter(2)):  # of one stamp as recorded
        event = decode(topic, data)
        if event is not None and event.kind in CHANGES and not event.subject.startswith("/"):
            found.setdefault(event.node, []).extend((stamp, each) for each in event.changes)
    return found


def _first(changes: Sequence[tuple[int, ParameterChange]], start: int, end: int) -> dict[str, str]:
    """Values, JSON, before the first change of each parameter from a stamp on and before another."""
    first: dict[str, str] = {}
    for stamp, each in changes:
        if start <= stamp < end:
            first.setdefault(each.name, each.old_value)
    return first


def _values(bag: Bag, node: str, answer: int | None, before: Mapping[str, str]) -> dict[str, Any]:
    """Parameters at a start, given what was recorded after it and the values, JSON, before later changes."""
    recorded = bag.metadata.get(parameters_record(node, answer), {})
    own = {name: text for name, text in recorded.items() if not name.startswith(OWN_OF_ROS)}
    values = parsed(own, f"{bag.path}: recorded parameters of {node} are")
    changed = {name: text for name, text in before.items() if name in own}
    return values | parsed(changed, f"{bag.path}: a recorded change of {node} is")


def parsed(values: Mapping[str, str], words: str) -> dict[str, Any]:
    """Values by name from JSON; raises ConfigurationError, with these words in front, for what is none."""
    try:
        return {name: from_json(text) for name, text in values.items()}
    except ValueError as error:
        raise ConfigurationError(f"{words} no JSON ({error})") from None
