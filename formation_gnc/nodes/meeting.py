"""Brings together what belongs to one tick: by stamp, never by order of arrival."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any


class Meeting:
    """Records of several topics that are to have one stamp.

    The first topic sets the pace: when its next record comes and the last one is still unanswered, whoever
    was missing then is lost and not waited for any more, until a record of theirs comes in time again. So
    one silent satellite costs the others one tick. Only the first `needed` topics are never given up.
    """

    def __init__(self, topics: Sequence[str], needed: int) -> None:
        """Wait for these topics; the first `needed` (one or more) are indispensable."""
        self._topics, self._others = tuple(topics), tuple(topics[needed:])
        self._latest: dict[str, Any] = {}
        self._lost: set[str] = set()
        self._answered: int | None = None

    def take(self, topic: str, record: Any) -> list[Any] | None:
        """Take a record in; once per stamp, the records of all topics in order, None for who is lost."""
        if self._others:
            self._mind_the_lost(topic, record)
        latest = self._latest
        latest[topic] = record
        pace = latest.get(self._topics[0])
        if pace is None or pace.time == self._answered:
            return None
        records = []
        for each in self._topics:
            there = latest.get(each)
            if there is None or there.time != pace.time:
                if each not in self._lost:
                    return None
                there = None
            records.append(there)
        self._answered = pace.time
        return records

    def _mind_the_lost(self, topic: str, record: Any) -> None:
        """Before a record is taken in: who is to be given up now, and who is back."""
        pace = self._latest.get(self._topics[0])
        if pace is None:
            return
        if topic == self._topics[0] and record.time != pace.time != self._answered:
            self._lost |= {
                each
                for each in self._others
                if each not in self._latest or self._latest[each].time != pace.time
            }
        elif record.time >= pace.time:
            self._lost.discard(topic)


class Wires:
    """Hands records from part to part inside one process, besides what is published."""

    def __init__(self) -> None:
        """Nobody speaks yet."""
        self._ears: dict[str, list[Callable[[Any], None]]] = {}
        self._waiting = deque[tuple[str, Any]]()

    def __contains__(self, topic: str) -> bool:
        """Whether a part in this process speaks on a topic."""
        return topic in self._ears

    def speak(self, topic: str) -> Callable[[Any], None]:
        """A function that hands a record on at the next `deliver`."""
        self._ears[topic] = []
        return lambda record: self._waiting.append((topic, record))

    def hear(self, topic: str, ear: Callable[[Any], None]) -> None:
        """Let `ear` have every record of a topic; who asks last hears first: the controller, who needs the
        estimate too, before guidance answers it."""
        self._ears[topic].insert(0, ear)

    def deliver(self) -> None:
        """Hand on what has been said since."""
        while self._waiting:
            topic, record = self._waiting.popleft()
            for ear in self._ears[topic]:
                ear(record)
