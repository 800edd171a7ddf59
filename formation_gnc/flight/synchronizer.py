"""Synchronization of several topics by stamp, never by order of arrival."""

from collections import OrderedDict, deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

HISTORY = 64
"""Stamps kept per topic. A topic that falls further behind finds the others missing for one tick."""


class Stamped(Protocol):
    """A record with a stamp."""

    time: int
    """ns."""


@dataclass(frozen=True)
class InputTopics:
    """Topics of a module's inputs, in the order in which it takes them; the first one sets the pace."""

    needed: tuple[str, ...]
    """At least one; always waited for."""
    delayed: tuple[str, ...] = ()
    """Optional; of the tick before."""
    optional: tuple[str, ...] = ()
    delay: int = 0
    """Time of a tick, ns; of the delayed ones."""
    has_delayed: Callable[[Any], bool] = lambda _: True
    """Whether there are delayed ones, by the pacing topic's record."""
    without: frozenset[str] = frozenset()
    """Delayed and optional topics that are always missing."""
    may_lag: bool = False
    """Whether a tick is waited for while the pacing topic is one further: nobody waits for the answer before then."""


class StampSynchronizer:
    """Collects the records of several topics that have the same stamp, delayed ones with that of the tick before.

    The first topic sets the pace. At each new stamp of it, an optional topic without a record where the previous
    one needed it counts as missing, and is not waited for; one with a record is. So a silent satellite delays the
    others by one tick, and is waited for again from the tick after it resumed, in whatever order records
    arrive. A pacing stamp that runs backwards starts a new run, with nothing missing. Before the first tick,
    at 0, there is nothing, and nothing to wait for. A delayed topic that has a record of the tick itself, without the
    one that is awaited, is missing.

    The next stamp of the pacing topic ends the wait, and there is no answer. With `may_lag` the one after it does, or
    one that says that delayed topics have nothing more, and the tick is answered without what is missing.

    Records are given one by one as they arrive (`take`, and `next` until there is no more), or all of a tick at once
    (`take_tick`).
    """

    def __init__(self, topics: InputTopics) -> None:
        """Synchronize these topics."""
        self._topics, self._pacing = topics, topics.needed[0]
        every = (*topics.needed, *topics.delayed, *topics.optional)
        self._received = {topic: OrderedDict[int, Stamped]() for topic in every}
        self._missing = _NONE
        """Topics that are not waited for at the current stamp."""
        self._awaited: tuple[str, ...] = ()
        """Optional topics that have a record of the current tick where they do not miss it."""
        self._absent = _NONE
        """Those of them that have none."""
        self._forgone = _NONE
        """Topics that nobody publishes."""
        self._current: int | None = None
        """Stamp of the pacing topic at which the others are awaited or were last returned, ns."""
        self._ahead = deque[Stamped]()
        """Later records of the pacing topic."""
        self._completed: int | None = None
        """Latest stamp at which all records were returned, ns."""

    def take(self, topic: str, record: Stamped) -> Sequence[Any] | None:
        """Add a record; once per stamp returns the records of all topics, each of its topic's own type.

        A stamp before 0 is of no run, and ignored.

        Returns:
            In the order of topics, None for a missing one; None in place of the list while records are awaited.
        """
        time, received = record.time, self._received[topic]
        if time < 0:
            return None
        if topic == self._pacing:
            if self._current is None or time < self._current:
                self._clear_after(time)
                self._advance(record)
            elif time <= _latest(received):
                return None
            else:
                self._ahead.append(record)
        elif received and time < _latest(received):
            received.clear()
        received[time] = record
        if len(received) > HISTORY:
            received.popitem(last=False)
        self._forgone -= {topic}
        return self.next()

    def next(self) -> Sequence[Any] | None:
        """As `take`, without another record: of the stamp after one that was returned."""
        while True:
            records = self._complete()
            if records is None and self.may_lag and self._is_over:
                records = self._complete(give_up=True)
            if records is not None:
                return records
            if not self._ahead or (self.unanswered is not None and not self._is_over):
                return None
            current = self._current or 0
            self._absent = frozenset(each for each in self._awaited if self._of(each, current) is None)
            self._advance(self._ahead.popleft())

    def forgo(self, topics: Collection[str]) -> Sequence[Any] | None:
        """Do without dispensable topics until they are heard; returns as `take`, for the current stamp."""
        self._forgone |= frozenset(topics)
        self._missing |= frozenset(each for each in topics if not self._received[each])
        return self.next()

    def abandon(self) -> None:
        """Do not answer the current stamp; who may lag then waits at the next one as it would have at any."""
        self._completed = self._current
        if self.may_lag:
            self._awaited = ()

    def _complete(self, give_up: bool = False) -> Sequence[Any] | None:
        """The records of the current stamp, once, when all are there that may still come; `give_up`: none may."""
        current = self._current
        if current is None or current == self._completed:
            return None
        missing = self._missing
        records = [None if each in missing else self._of(each, current) for each in self._received]
        if records.count(None) > len(missing):
            missing |= frozenset(each for each in self._awaited if give_up or self._has_passed(each, current))
            if any(each is None and name not in missing for each, name in zip(records, self._received, strict=True)):
                return None
        self._completed = current
        return records

    def take_tick(
        self, records: Mapping[str, Any], before: Mapping[str, Any], missing: Sequence[int] | None = None
    ) -> Sequence[Any] | None:
        """As `take` of all records of a tick, by topic, with those of the tick before: what is not there is not late.

        missing: places of the topics that were missing, where the tick is known to have been answered without.

        Returns:
            As `take`; None when the tick cannot be answered.
        """
        topics, pacing = self._topics, records.get(self._pacing)
        if pacing is None or pacing.time == self._current:
            return None
        self._advance(pacing)
        if missing is not None:
            names = tuple(self._received)
            self._missing = frozenset(names[place] for place in missing if place < len(names))
        try:
            inputs = [records[topic] for topic in topics.needed]
            if topics.delayed:
                inputs += [before[topic] for topic in topics.delayed]
            if topics.optional:
                inputs += [records[topic] for topic in topics.optional]
        except KeyError:
            sources = dict.fromkeys(topics.delayed, before)
            inputs = [sources.get(topic, records).get(topic) for topic in self._received]
            there = [topic for topic, each in zip(self._received, inputs, strict=True) if each is not None]
            self._absent = frozenset(self._awaited).difference(there)
            if not self._missing.issuperset(self._received.keys() - there):
                return None
        if self._missing:
            return [
                None if topic in self._missing else each for topic, each in zip(self._received, inputs, strict=True)
            ]
        return inputs

    @property
    def may_lag(self) -> bool:
        """Whether a tick is waited for while the pacing topic is one further."""
        return self._topics.may_lag

    @property
    def unanswered(self) -> Any | None:
        """The pacing record of the current stamp while others are awaited; None for none."""
        current = self._current
        return None if current is None or current == self._completed else self._received[self._pacing].get(current)

    @property
    def _is_over(self) -> bool:
        """Whether the pacing topic has ended the wait at the current stamp."""
        ahead = self._ahead
        return len(ahead) > self.may_lag or (bool(ahead) and not self._topics.has_delayed(ahead[-1]))

    def _has_passed(self, topic: str, current: int) -> bool:
        """Whether a delayed topic has a record of the current stamp: that of the tick before does not come any more."""
        return topic in self._topics.delayed and current in self._received[topic]

    def _of(self, topic: str, time: int) -> Stamped | None:
        """The record of a topic for a pacing stamp (ns)."""
        return self._received[topic].get(time - self._topics.delay if topic in self._topics.delayed else time)

    def _advance(self, pacing: Stamped) -> None:
        """Go to the stamp of a record of the pacing topic."""
        topics, time = self._topics, pacing.time
        if self._current is not None and time < self._current:
            self._absent, self._completed = _NONE, None
        self._current = time
        self._missing, self._absent = self._absent, _NONE
        self._awaited = topics.optional
        if topics.delayed:
            if time >= topics.delay and topics.has_delayed(pacing):
                self._awaited += topics.delayed
            else:
                self._missing |= frozenset(topics.delayed)
        if topics.without or self._forgone:
            self._missing |= topics.without | self._forgone

    def _clear_after(self, time: int) -> None:
        """Drop the records that topics have left from a run that had come further than a time (ns)."""
        self._ahead.clear()
        for received in self._received.values():
            if received and _latest(received) > time:
                received.clear()


_NONE: frozenset[str] = frozenset()


def _latest(received: OrderedDict[int, Stamped]) -> int:
    return next(reversed(received))
