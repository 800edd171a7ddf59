"""Several publishers of one topic: whose messages count, and who is named."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""In the place of a publisher's name, as ROS has it, until the middleware knows it."""


@dataclass
class _Stream:
    """Messages of one publisher: the last stamp (ns) and number received from it."""

    stamp: int
    number: int | None

    def leads_to(self, stamp: int, number: int | None) -> bool:
        """Whether a message is the next one."""
        return stamp > self.stamp and (number is None or self.number is None or number == self.number + 1)


class SourceLock:
    """Keeps a reader to one publisher where others publish the topic too.

    A message does not carry its publisher, but each publisher numbers its own. While a topic has one publisher, every
    message counts, as those of a new run do; while it has several, only what leads on from the last that counted,
    and not from what others have published. The name of a publisher may be known later than its first messages:
    they count, as those of a node that was started again, until the publisher before goes on.
    """

    def __init__(self) -> None:
        """No message has come."""
        self.ignored = 0
        """Messages that did not count."""
        self._heard: _Stream | None = None
        self._before: _Stream | None = None
        """The one before, which has ended if the one that counts is the same node started again."""
        self._others: list[_Stream] = []

    def accepts(self, stamp: int, number: int | None, is_shared: Callable[[], bool]) -> bool:
        """Whether a message counts.

        Args:
            stamp: ns.
            number: its publisher's sequence number; None where the middleware has none.
            is_shared: whether the topic has several publishers; asked only where the numbers do not decide.
        """
        heard = self._heard
        follows = heard is None or heard.leads_to(stamp, number)
        others = [each for each in self._others if number is not None and each.leads_to(stamp, number)]
        if not follows and heard and self._before and number is not None and self._before.leads_to(stamp, number):
            self._others.append(heard)  # a stranger, whose name was not known yet
            self._heard, self._before = _Stream(stamp, number), None
            return True
        if others and (not follows or is_shared()):
            others[0].stamp, others[0].number = stamp, number
            self.ignored += 1
            return False
        if not follows and is_shared():
            self._others.append(_Stream(stamp, number))
            self.ignored += 1
            return False
        if not follows:
            self._others.clear()
            self._before = heard
        self._heard = _Stream(stamp, number)
        return True


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
