"""Several publishers of one topic: whose messages count, and who is named."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum

UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""In the place of a publisher's name, as ROS has it, until the middleware knows it."""

SUCCESSION = 0.5
"""Wall time (s) of silence after which a node's publisher is taken for dead, if the node has a new one."""

LOOK = 0.1
"""Wall time (s) for which the list of a topic's publishers is not asked for again, whatever is received."""


class Verdict(Enum):
    """What is to be done with a message."""

    COUNTS = "counts"
    HELD = "held"
    """It counts once its publisher has succeeded the one before."""
    REFUSED = "refused"


class SourceLock:
    """Keeps a reader to one publisher of a topic, by its identity.

    The first one whose message counted stays the one until it has left the graph. A process that was killed stays
    listed for a while: a new publisher of a node of the same name succeeds it when it has been silent for SUCCESSION
    since the new one's first message. If it was only slow, and goes on after all, it counts again, the other does not.
    Times `now` are seconds of a monotonic wall clock.
    """

    def __init__(self, publishers: Callable[[], Mapping[bytes, str]]) -> None:
        """No message has come.

        publishers: full names of the nodes that publish the topic just now, by identity of their publishers.
        """
        self.chosen: bytes | None = None
        """Identity of the one that counts."""
        self.refused: Counter[str] = Counter()
        """Messages that did not count, by the name of the node."""
        self.candidate: bytes | None = None
        """Identity of the one that may succeed."""
        self._publishers, self._listed, self._looked = publishers, dict[bytes, str](), -LOOK
        self._names: dict[bytes, str] = {}
        self._since = 0.0
        self._before: bytes | None = None
        self._twins: set[bytes] = set()

    @property
    def ignored(self) -> int:
        """Messages that did not count."""
        return self.refused.total()

    def judge(self, publisher: bytes, now: float) -> Verdict:
        """Whether a message of a publisher counts."""
        if self.chosen in (None, publisher):
            self._drop_candidate()
            return Verdict.COUNTS
        if publisher == self._before and self.chosen is not None:
            self._twins.add(self.chosen)
            self.choose(publisher)
            return Verdict.COUNTS
        self._look(now)
        if self.chosen not in self._listed:
            self._succeed(publisher)
            return Verdict.COUNTS
        if publisher not in self._twins and self._may_be_the_same_node(publisher):
            if self.candidate != publisher:
                self.candidate, self._since = publisher, now
            return Verdict.HELD
        self.refused[self.name_of(publisher, now)] += 1
        return Verdict.REFUSED

    def choose(self, publisher: bytes) -> None:
        """Keep to a publisher, whose message counted."""
        self.chosen, self._before, self.candidate = publisher, None, None

    def succeeds(self, now: float) -> bool:
        """Whether the candidate, if there is one, now counts in place of the one before."""
        if self.candidate is None or now - self._since < SUCCESSION:
            return False
        self._look(now)
        publisher, before = self.candidate, self.chosen
        if before in self._listed and self._listed.get(publisher) != self._listed[before]:
            return False
        self._succeed(publisher)
        self._before = before
        return True

    def name_of(self, publisher: bytes, now: float) -> str:
        """Full name of a publisher's node, if it is known or was."""
        if publisher not in self._names:
            self._look(now)
        return self._names.get(publisher, "an unknown node")

    def _succeed(self, publisher: bytes) -> None:
        self.choose(publisher)
        self._twins.clear()

    def _drop_candidate(self) -> None:
        """The one that counts goes on: who would have succeeded it is another."""
        if self.candidate is not None:
            self._twins.add(self.candidate)
            self.candidate = None

    def _may_be_the_same_node(self, publisher: bytes) -> bool:
        """Whether the names of its node and of the chosen one's are the same, or not known yet."""
        name, other = self._listed.get(publisher, UNKNOWN), self._listed.get(self.chosen or b"", UNKNOWN)
        return name == other or UNKNOWN in name or UNKNOWN in other

    def _look(self, now: float) -> None:
        if now - self._looked >= LOOK:
            self._looked, self._listed = now, dict(self._publishers())
            self._names |= {each: name for each, name in self._listed.items() if UNKNOWN not in name}


def names_of(publishers: Sequence[str]) -> str:
    """Full names of nodes in words, each once, with how many have it."""
    counts = Counter(publishers)
    return " and ".join(name if count == 1 else f"{name} ({count} times)" for name, count in sorted(counts.items()))


def is_shared(publishers: Sequence[str]) -> bool:
    """Whether nodes of different names publish a topic.

    One that is started again may be listed twice for a while, and at first without its name.
    """
    return len({each for each in publishers if UNKNOWN not in each}) > 1


def shared(topics: Sequence[str], publishers_of: Callable[[str], Sequence[str]]) -> Iterator[tuple[str, str]]:
    """Topics that more than one node publishes, whatever their names, and those nodes in words."""
    for topic in topics:
        publishers = publishers_of(topic)
        if len(publishers) > 1:
            yield topic, names_of(publishers)
