"""Brings together what belongs to one tick: by stamp, never by order of arrival."""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

MEMORY = 64
"""Stamps remembered of a topic: one that pauses for longer finds the others lost for a tick."""


class StampSynchronizer:
    """Records of several topics that are to have one stamp.

    The first topic sets the pace. A record of its that finds somebody without one at its last stamp does
    without them; else it waits. So one silent satellite costs the others one tick, and whoever speaks again
    is waited for from the next tick on, in whatever order their records come. Only the first `needed` topics
    are never done without. Stamps that run backwards are those of a new run, and it begins as the first did.
    """

    def __init__(self, topics: Sequence[str], needed: int) -> None:
        """Wait for these topics; the first `needed` (one or more) are indispensable."""
        self._heard = {topic: OrderedDict[int, Any]() for topic in topics}
        self._pace, self._dispensable = topics[0], tuple(topics[needed:])
        self._lost: frozenset[str] = frozenset()
        self._now: int | None = None
        self._answered: int | None = None

    def take(self, topic: str, record: Any) -> list[Any] | None:
        """Take a record in; once per stamp, the records of all topics in order, None for who is lost."""
        time, heard = record.time, self._heard[topic]
        if heard and time < _last(heard):
            heard.clear()
        if topic == self._pace and time != self._now:
            if self._now is not None and time < self._now:
                self._begin_again(time)
            elif self._dispensable and self._now is not None:
                self._lost = frozenset(each for each in self._dispensable if self._now not in self._heard[each])
            self._now = time
        heard[time] = record
        if len(heard) > MEMORY:
            heard.popitem(last=False)
        now = self._now
        if now is None or now == self._answered:
            return None
        records = [None if each in self._lost else told.get(now) for each, told in self._heard.items()]
        if records.count(None) > len(self._lost):
            return None
        self._answered = now
        return records

    def _begin_again(self, time: int) -> None:
        """Forget who was lost, and what was said by those who have not begun again yet."""
        self._lost, self._answered = frozenset(), None
        for told in self._heard.values():
            if told and _last(told) > time:
                told.clear()


def _last(heard: OrderedDict[int, Any]) -> int:
    last: int = next(reversed(heard))
    return last
