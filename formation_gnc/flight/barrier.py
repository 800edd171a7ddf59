"""The tick barrier: when a tick is over, who is awaited, who missed it."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

LONGEST_CHECK_GAP = 0.5
"""Wall time (s) between two checks beyond which the barrier itself has been held up."""


LONGEST_START = 300.0
"""Wall time (s) beyond the deadline that a first answer is awaited: kernels may have to be compiled."""


@dataclass(frozen=True)
class Decision:
    """Decision on the tick in flight.

    advance: the tick is over, and its answers are complete but for who missed it.
    waiting_for: whose answer, or the recorder's progress, is missing.
    pause: wall time (s) until the pace allows the next tick; 0 when nothing but an answer is missing.
    overdue: whether the deadline has passed, so that the wait is worth a log line.
    """

    advance: bool = False
    waiting_for: tuple[str, ...] = ()
    pause: float = 0.0
    overdue: bool = False


ADVANCE = Decision(advance=True)


@dataclass
class TickBarrier:
    """Lock-step of the plant with the deputies and the recorder, driven by stamps and a clock passed in.

    A tick is over when every deputy has answered it or missed it, the recorder is within its allowed lag, and
    the pace allows it. A deputy that has answered once misses a tick when it has not answered `deadline` s
    after the tick opened; its first answer is awaited LONGEST_START longer, since nodes take time to start.

    deputies: who answers. deadline: s of wall time, infinite for none. allowed_lag: ns that the recorder may be behind.
    period: wall time (s) of a tick at the real-time factor; 0 for as fast as possible.
    """

    deputies: Sequence[str]
    deadline: float
    allowed_lag: int
    period: float = 0.0
    answers: dict[str, Any] = field(default_factory=dict)
    """Answers to the tick in flight, by deputy."""
    stamp: int = -1
    """Stamp of the tick in flight, ns; -1 before the first."""
    recorded: int | None = None
    """Stamp (ns) up to which the recorder has everything; None before its first report."""
    has_recorder: bool = False
    contradictions: Counter[str] = field(default_factory=Counter)
    """By deputy, ticks to which it has given two different answers."""

    def __post_init__(self) -> None:
        """No tick is open."""
        self._awaited: set[str] = set()
        self._known: set[str] = set()
        self._before: tuple[int, dict[str, Any]] = (-1, {})
        self._opened = self._started = self._checked = 0.0
        self._ticks = 0

    def open(self, stamp: int, now: float) -> None:
        """Begin a tick: its measurements are on their way."""
        if self._ticks == 0:
            self._started = self._checked = now
        self._ticks += 1
        self._before = self.stamp, self.answers
        self.stamp, self._opened = stamp, now
        self.answers = {}
        self._awaited = set(self.deputies)

    def answer(self, deputy: str, stamp: int, answer: Any) -> bool:
        """Take an answer; returns whether it counts: of the tick in flight, from who is awaited."""
        if stamp != self.stamp or deputy not in self._awaited:
            self._note_contradiction(deputy, stamp, answer)
            return False
        self._awaited.discard(deputy)
        self._known.add(deputy)
        self.answers[deputy] = answer
        return True

    def _note_contradiction(self, deputy: str, stamp: int, answer: Any) -> None:
        answers = {self.stamp: self.answers, self._before[0]: self._before[1]}.get(stamp, {})
        if deputy in answers and not np.array_equal(answers[deputy], answer, equal_nan=True):
            self.contradictions[deputy] += 1

    def check(self, now: float) -> None:
        """Apply the deadline; called regularly.

        Time in which the barrier itself got no processor is not held against the deputies.
        """
        self._opened += max(0.0, now - self._checked - LONGEST_CHECK_GAP)
        self._checked = now
        if self._is_overdue(now):
            self._awaited -= self._known
            if now - self._opened > self.deadline + LONGEST_START:
                self._awaited.clear()

    def decide(self, now: float) -> Decision:
        """Whether the tick is over, and if not, what it waits for."""
        if self._awaited:
            return Decision(waiting_for=tuple(sorted(self._awaited)), overdue=self._is_overdue(now))
        if self.recorder_lags():
            return Decision(waiting_for=("/recorder",), overdue=self._is_overdue(now))
        if self.period > 0.0 and (pause := self._started + self._ticks * self.period - now) > 0.0:
            return Decision(pause=pause)
        return ADVANCE

    def recorder_lags(self) -> bool:
        """Whether the recorder is further behind than the queues allow."""
        return self.has_recorder and self.stamp > (self.recorded or 0) + self.allowed_lag

    def recorder_is_done(self, end: int) -> bool:
        """Whether no recorder is there, or it has everything up to the end of the run (ns)."""
        return not self.has_recorder or (self.recorded is not None and self.recorded >= end)

    def reason_of_miss(self, deputy: str, absent: Collection[str]) -> str:
        """Why a deputy got no thrust, for people; nobody publishes its `absent` topics, as far as DDS knows."""
        if deputy in self.answers:
            return f"commanded {self.answers[deputy].tolist()} N"
        if self.deadline == inf:
            return "no answer"
        where = f" (nobody publishes {', '.join(absent)})" if absent else ""
        return f"did not answer within {self.deadline:g} s{where}"

    def _is_overdue(self, now: float) -> bool:
        return now - self._opened > self.deadline
