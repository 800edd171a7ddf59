"""Collection of the parameters of all nodes of a run, for a recording."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH
from formation_gnc.recording.provenance import parameters_record

ASK_AGAIN = 2.0
"""Wall time (s) after which a request is repeated: ROS drops the answer to a client that it has not discovered
yet, as happens when many nodes start on a busy machine."""

PLANT = "/plant"


@dataclass
class ParameterCollection:
    """Parameters of all nodes of a run, requested when a node appears and after every restart."""

    values: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    """Latest parameters by full node name."""

    def __post_init__(self) -> None:
        """Start with no node known."""
        self._known: set[str] = set()
        self._wanted: dict[str, str] = {}
        self._asked: dict[str, float] = {}
        self._mute: dict[str, float] = {}

    def find(
        self, known: Collection[str], formation: str, publishers_of: Callable[[str], Collection[str]], now: float
    ) -> dict[str, str]:
        """Take the nodes that exist; returns their full names by those within the formation.

        A node of the run counts by what it publishes, whatever its name.

        Args:
            known: full names of the nodes that offer parameter services.
            formation: its namespace, with a slash at the end.
            publishers_of: full names of the nodes that publish a topic.
            now: s; a node of the run that offers no parameter services may yet.
        """
        nodes = {f"/{each.removeprefix(formation)}": each for each in known if each.startswith(formation)}
        for role, topic in self._roles().items():
            for full_name in publishers_of(topic) if role not in nodes else ():
                if full_name in known:
                    nodes[role] = full_name
                else:
                    self._mute.setdefault(role, now)
        self.appeared(nodes)
        return nodes

    def _roles(self) -> dict[str, str]:
        """What each node of the run publishes, by its name."""
        deputies = self.values.get(PLANT, {}).get("deputies", ())
        answers = {f"/{deputy}/{row.name}": row.answer.of(deputy) for deputy in deputies for row in GRAPH}
        return {PLANT: topics.TRUTH.name} | answers

    def appeared(self, nodes: Collection[str]) -> list[str]:
        """Take the nodes that exist; returns the new ones."""
        new = [node for node in nodes if node not in self._known]
        self._known.update(new)
        self._wanted |= {node: parameters_record(node) for node in new}
        return new

    def restarted(self, node: str, stamp: int) -> None:
        """Request the parameters of a restarted node again; `stamp` (ns) is that of its first answer."""
        if node in self._known:
            self._wanted[node] = parameters_record(node, stamp)
            self._asked.pop(node, None)

    def due(self, now: float) -> dict[str, str]:
        """Nodes whose request is due at a time (s), with the names of the metadata records for the answers."""
        return {
            node: record
            for node, record in self._wanted.items()
            if now - self._asked.get(node, -ASK_AGAIN) >= ASK_AGAIN
        }

    def asked(self, node: str, now: float) -> None:
        """Note the time (s) of a request."""
        self._asked[node] = now

    def received(self, node: str, record: str, values: Mapping[str, Any]) -> bool:
        """Take an answer; returns whether to record it, which an answer to an outdated request is not."""
        if self._wanted.get(node) != record:
            return False
        del self._wanted[node]
        self.values[node] = values
        return True

    def is_complete(self, now: float) -> bool:
        """Whether the parameters of the plant and of every deputy's modules, if they have any, are known."""
        nodes = self._roles().keys() - {PLANT}
        return bool(nodes) and all(
            self.values.get(node) or now - self._mute.get(node, now) > ASK_AGAIN for node in nodes
        )
