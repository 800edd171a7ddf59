"""Who may do what on a flight's graph: what each process publishes, hears, serves and calls, from the graph table.

`transport/dds_security.py` writes it as the permissions of DDS security; the page of topics is written from it too.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from formation_gnc.flight import topics
from formation_gnc.flight.graph import COMMAND, DISPLAY, GRAPH, PLANT, RECORDER, Row
from formation_gnc.flight.topics import Topic

LAUNCHER = "/sil"
OPERATOR = "/operator"
"""Enclave of people and their tools: hears everything, and changes parameters; it publishes nothing."""

SATELLITE = "satellite"
"""Process of all modules of a deputy."""

OF_EVERY_NODE = (topics.EVENTS, topics.DIAGNOSTICS)
"""Topics that every node publishes."""

READING = ("describe_parameters", "get_parameter_types", "get_parameters", "list_parameters")
SETTING = ("set_parameters", "set_parameters_atomically")
"""Parameter services of every node: those that tell, and those that command."""

TYPE_DESCRIPTION = "get_type_description"
"""Service of every node of rclpy, with parameter services or without."""

EVERY_TOPIC = "/*"


@dataclass(frozen=True)
class RunNode:
    """A node of the run, of which there is one: topics it takes and gives, a deputy's standing for those of all."""

    takes: tuple[Topic, ...]
    gives: tuple[Topic, ...]


NODES_OF_RUN = {
    PLANT: RunNode((COMMAND, topics.PROGRESS), (topics.CLOCK, topics.TRUTH, topics.MEASUREMENT)),
    DISPLAY: RunNode((topics.TRUTH, topics.TARGET), (topics.MARKERS, topics.TF, topics.TRANSFORMS)),
}
"""Those that take what they know; the recorder takes everything."""


@dataclass(frozen=True)
class Access:
    """What a process may do, by full names of topics and services, in which `*` stands for any characters."""

    publishes: frozenset[str] = frozenset()
    subscribes: frozenset[str] = frozenset()
    serves: frozenset[str] = frozenset()
    calls: frozenset[str] = frozenset()

    def __or__(self, other: "Access") -> "Access":
        """What a process may do that is both."""
        return Access(
            self.publishes | other.publishes,
            self.subscribes | other.subscribes,
            self.serves | other.serves,
            self.calls | other.calls,
        )


def access_by_process(deputies: Sequence[str], formation: str = "") -> dict[str, Access]:
    """What each process of a flight may do, by its full name, which is that of its enclave.

    Args:
        deputies: names of all.
        formation: namespace of all nodes, such as "/north"; empty for none.
    """
    modules = {f"/{deputy}/{row.name}": _of_module(row, deputy, deputies) for deputy in deputies for row in GRAPH}
    nodes = {name: _node(name, node.takes, node.gives, deputies) for name, node in NODES_OF_RUN.items()} | modules
    served = frozenset(each for access in nodes.values() for each in access.serves)
    told = {f"{name}/{service}" for name in (*nodes, RECORDER) for service in ("get_parameters", "list_parameters")}
    recorder = _node(RECORDER, (), (topics.PROGRESS,), deputies)
    recorder |= Access(frozenset(), frozenset({EVERY_TOPIC}), frozenset({f"{RECORDER}/snapshot"}), frozenset(told))
    operated = {each for each in served | recorder.serves if not each.endswith(TYPE_DESCRIPTION)}
    composed = {
        f"/{deputy}/{SATELLITE}": _together(modules[f"/{deputy}/{row.name}"] for row in GRAPH) for deputy in deputies
    }
    everything = nodes | composed | {RECORDER: recorder}
    placed = {f"{formation}{name}": _within(formation, access) for name, access in everything.items()}
    tool = Access(serves=frozenset({f"{EVERY_TOPIC}/{TYPE_DESCRIPTION}"}))  # of nodes of any name
    launcher = tool | Access(subscribes=frozenset({topics.DIAGNOSTICS.name}))
    operator = (
        tool | _within(formation, Access(calls=frozenset(operated))) | Access(subscribes=frozenset({EVERY_TOPIC}))
    )
    return placed | {LAUNCHER: launcher, OPERATOR: operator}


def full_names(topic: Topic, deputies: Sequence[str]) -> list[str]:
    """Full names of a topic: one of the run's, or one for each deputy; none of a fleet's where there is none."""
    if topic.name.startswith("/"):
        return [topic.name]
    return [topic.of(deputy) for deputy in deputies if len(deputies) > 1 or not topic.fleet_only]


def _of_module(row: Row, deputy: str, deputies: Sequence[str]) -> Access:
    own = [each.topic.of(deputy) for each in (*row.takes, *row.takes_of_before)]
    others = [each.topic.of(other) for each in row.takes_of_others for other in deputies if other != deputy]
    gives = {topic.of(deputy) for topic in row.gives if len(deputies) > 1 or not topic.fleet_only}
    access = _node(f"/{deputy}/{row.name}", (), (), deputies)
    given = gives | {topics.TIMING.of(deputy)}
    return access | Access(publishes=frozenset(given), subscribes=frozenset([*own, *others]))


def _node(name: str, takes: Iterable[Topic], gives: Iterable[Topic], deputies: Sequence[str]) -> Access:
    """What a node takes and gives, and what every node has."""
    return Access(
        frozenset(each for topic in (*gives, *OF_EVERY_NODE) for each in full_names(topic, deputies)),
        frozenset(each for topic in takes for each in full_names(topic, deputies)),
        frozenset(f"{name}/{service}" for service in (*READING, *SETTING, TYPE_DESCRIPTION)),
    )


def _together(accesses: Iterable[Access]) -> Access:
    result = Access()
    for access in accesses:
        result |= access
    return result


def _within(formation: str, access: Access) -> Access:
    """The same in a formation's namespace; that of diagnostics is ROS's."""

    def placed(names: frozenset[str]) -> frozenset[str]:
        return frozenset(
            name if name in (EVERY_TOPIC, topics.DIAGNOSTICS.name) else f"{formation}{name}" for name in names
        )

    return replace(
        access,
        publishes=placed(access.publishes),
        subscribes=placed(access.subscribes),
        serves=placed(access.serves),
        calls=placed(access.calls),
    )
