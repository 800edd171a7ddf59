"""Brings together what belongs to one tick: by stamp, never by order of arrival."""

from collections import deque
from collections.abc import Sequence
from typing import Any

MEMORY = 64
"""Stamps remembered of a topic: one that pauses for longer finds the others lost for a tick."""


class Meeting:
    """Records of several topics that are to have one stamp.

    The first topic sets the pace. A record of its that finds somebody without one at its last stamp does
    without them; else it waits. So one silent satellite costs the others one tick, and whoever speaks again
    is waited for from the next tick on, in whatever order their records come. Only the first `needed` topics
    are never done without.
    """

    def __init__(self, topics: Sequence[str], needed: int) -> None:
        """Wait for these topics; the first `needed` (one or more) are indispensable."""
        self._heard = {topic: deque[Any](maxlen=MEMORY) for topic in topics}
        self._pace, self._dispensable = topics[0], tuple(topics[needed:])
        self._lost: frozenset[str] = frozenset()
        self._answered: int | None = None

    def take(self, topic: str, record: Any) -> list[Any] | None:
        """Take a record in; once per stamp, the records of all topics in order, None for who is lost."""
        heard, pace = self._heard[topic], self._heard[self._pace]
        if heard and heard[-1].time == record.time:
            heard.pop()
        elif topic == self._pace and heard and self._dispensable:
            before = heard[-1].time
            self._lost = frozenset(each for each in self._dispensable if self._at(each, before) is None)
        heard.append(record)
        if not pace or pace[-1].time == self._answered:
            return None
        now = pace[-1].time
        records = [None if each in self._lost else self._at(each, now) for each in self._heard]
        if records.count(None) > len(self._lost):
            return None
        self._answered = now
        return records

    def _at(self, topic: str, time: int) -> Any:
        for record in reversed(self._heard[topic]):
            if record.time == time:
                return record
        return None
