"""Messages that wait for a module that joins a flight in progress, or has been busy."""

from typing import Any

from formation_gnc.flight.graph import ModuleInstance

SETTLING = 100_000_000
"""Wall time (ns) without another message after which a node that joins a flight in progress has all from before."""

STALLED = 500_000_000
"""As SETTLING, while nothing published after its start has arrived."""

SOON = 1_000_000
"""As SETTLING, for a node that has been busy: what has come meanwhile is received within this time."""

LATE = 50_000_000
"""Wall time (ns) after which a message that is received counts as one of several that wait."""


class Backlog:
    """Decides with which of several ticks a module goes on: an answer to an older one would look like a new run.

    What the module cannot start without is not skipped, if it was published after its start. At the first two ticks
    of a flight nor is what was before, by a module that may be a tick behind: others wait for its answer at the second.
    """

    def __init__(self, instance: ModuleInstance, started: int) -> None:
        """No messages; `started` is the wall time (ns) of the module's start."""
        self._instance, self._started = instance, started
        self._pace, self._tick = instance.needed[0], instance.module.parameters.tick_ns
        self._waiting: dict[str, list[tuple[int, Any]]] = {}
        self._has_caught_up = self._is_addressed = False
        self._bygone: Any = None
        """Pacing record from before the start with which it went on, for want of a later one."""
        self.due: int | None = None
        """Wall time (ns) at which to go on with those that wait; None when there are none."""

    def add(self, topic: str, record: Any, published: int, now: int) -> bool:
        """Whether a record is to be taken at once; else it waits here.

        Args:
            topic: full name.
            record: of a message on it.
            published: wall time (ns) at which it was.
            now: wall time, ns.
        """
        is_pacing, is_late = topic == self._pace, now - published >= LATE
        is_behind = is_pacing and self._instance.synchronizer.unanswered is not None
        if not self._waiting and not is_behind and not is_late:
            self._has_caught_up = True
            return True
        # Until it has caught up, what was before its start may come in parts; by each publisher in order.
        addresses = is_pacing and published >= self._started and not self._is_addressed
        self._is_addressed |= addresses
        if self.due is None or addresses or (is_late and not self._has_caught_up):
            self.due = now + (SOON if self._has_caught_up else SETTLING if self._is_addressed else STALLED)
        self._waiting.setdefault(topic, []).append((published, record))
        return False

    def take(self) -> list[tuple[str, Any]]:
        """Those that wait and count, as (topic, record), in the order in which to take them."""
        self.due, waiting, self._waiting = None, self._waiting, {}
        records = {topic: _of_latest_run(messages) for topic, messages in waiting.items()}
        pacing = records.get(self._pace, [])
        is_at_begin = self._instance.synchronizer.may_lag and bool(pacing) and pacing[-1][1].time <= self._tick
        addressed = [record for published, record in pacing[:-1] if is_at_begin or published >= self._started]
        addressed += [record for _, record in pacing[-1:]]
        begun = self._instance.synchronizer.unanswered
        if begun is not None and begun is not self._bygone and addressed and begun.time < addressed[0].time:
            addressed.insert(0, begun)  # what it awaits may be among those that wait
        if pacing and pacing[-1][0] < self._started and not is_at_begin:
            self._bygone = pacing[-1][1]
        first = self._instance.module.first_of(addressed).time if addressed else 0
        if begun is not None and begun.time < first:
            self._instance.synchronizer.abandon()
        kept = []
        for topic, messages in records.items():
            begin = first - self._tick * (topic in self._instance.delayed)
            kept += [(topic, each) for _, each in messages if each.time >= begin]
        return sorted(kept, key=lambda each: (each[1].time, each[0] == self._pace))


def _of_latest_run(messages: list[tuple[int, Any]]) -> list[tuple[int, Any]]:
    """Messages, each with when it was published, from the last one on whose stamp went back."""
    backward = [place for place in range(1, len(messages)) if messages[place][1].time < messages[place - 1][1].time]
    return messages[backward[-1] if backward else 0 :]
