"""Synchronization of several topics by stamp, never by order of arrival."""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, Protocol

HISTORY = 64
"""Stamps kept per topic. A topic that falls further behind finds the others missing for one tick."""


class Stamped(Protocol):
    """A record with a stamp."""

    time: int
    """ns."""


class StampSynchronizer:
    """Collects the records of several topics that have the same stamp.

    The first topic sets the pace. At each new stamp of it, an optional topic without a record at the previous
    stamp counts as missing, and is not waited for; one with a record is. So a silent satellite delays the
    others by one tick, and is waited for again from the tick after it resumed, in whatever order records
    arrive. The first `needed` topics are always waited for. A pacing stamp that runs backwards starts a new
    run, with nothing missing.
    """

    def __init__(self, topics: Sequence[str], needed: int) -> None:
        """Synchronize these topics, of which the first `needed` (at least one) are required."""
        self._received = {topic: OrderedDict[int, Stamped]() for topic in topics}
        self._pacing, self._optional = topics[0], tuple(topics[needed:])
        self._missing: frozenset[str] = frozenset()
        self._current: int | None = None
        """Latest stamp of the pacing topic, ns."""
        self._completed: int | None = None
        """Latest stamp at which all records were returned, ns."""

    def take(self, topic: str, record: Stamped) -> list[Any] | None:
        """Add a record; once per stamp returns the records of all topics, each of its topic's own type.

        A stamp before 0 is of no run, and ignored.

        Returns:
            In the order of topics, None for a missing one; None in place of the list while records are awaited.
        """
        time, received = record.time, self._received[topic]
        if time < 0:
            return None
        if received and time < _latest(received):
            received.clear()
        if topic == self._pacing and time != self._current:
            self._advance(time)
        received[time] = record
        if len(received) > HISTORY:
            received.popitem(last=False)
        current = self._current
        if current is None or current == self._completed:
            return None
        records = [None if each in self._missing else of.get(current) for each, of in self._received.items()]
        if records.count(None) > len(self._missing):
            return None
        self._completed = current
        return records

    def _advance(self, time: int) -> None:
        """Go to a new stamp (ns) of the pacing topic."""
        previous, self._current = self._current, time
        if previous is not None and time < previous:
            self._restart(time)
        elif self._optional and previous is not None:
            self._missing = frozenset(each for each in self._optional if previous not in self._received[each])

    def _restart(self, time: int) -> None:
        """Start a new run at a stamp (ns), without the records that topics have left from the previous run."""
        self._missing, self._completed = frozenset(), None
        for received in self._received.values():
            if received and _latest(received) > time:
                received.clear()


def _latest(received: OrderedDict[int, Stamped]) -> int:
    return next(reversed(received))
