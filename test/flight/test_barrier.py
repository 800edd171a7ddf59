"""The lock-step without processes: any interleaving of answers, deaths, restarts, deadlines and recorders."""

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from formation_gnc.flight.barrier import ADVANCE, LONGEST_CHECK_GAP, LONGEST_START, TickBarrier

TICK = 1_000_000_000
DEADLINE = 2.0
LAG = 3
FORCE = np.zeros(3)
DEPUTIES = ("deputy1", "deputy2", "deputy3")


def barrier(*deputies: str, period: float = 0.0) -> TickBarrier:
    """A barrier with its first tick open at stamp 0 and time 0."""
    result = TickBarrier(deputies or ("deputy1",), DEADLINE, LAG * TICK, period)
    result.open(0, 0.0)
    return result


def test_a_tick_is_over_when_every_deputy_has_answered() -> None:
    lock = barrier("deputy1", "deputy2")
    assert lock.decide(0.0).waiting_for == ("deputy1", "deputy2")
    assert lock.answer("deputy2", 0, FORCE)
    assert lock.decide(0.0).waiting_for == ("deputy1",)
    assert lock.answer("deputy1", 0, FORCE)
    assert lock.decide(0.0) == ADVANCE


def test_an_answer_counts_once_and_only_to_the_tick_in_flight() -> None:
    lock = barrier("deputy1", "deputy2")
    assert not lock.answer("deputy1", TICK, FORCE), "of a tick to come"
    assert lock.answer("deputy1", 0, FORCE)
    assert not lock.answer("deputy1", 0, np.ones(3)), "the first answer of a stamp counts"
    assert not lock.answer("stranger", 0, FORCE)
    assert lock.answers == {"deputy1": FORCE}
    lock.open(TICK, 0.1)
    assert not lock.answer("deputy1", 0, FORCE), "of a tick that is over"


def test_a_first_answer_is_awaited_long_beyond_the_deadline() -> None:
    lock = barrier()
    for second in range(700):
        lock.check(0.4 * second)
    decision = lock.decide(280.0)
    assert decision.waiting_for == ("deputy1",)
    assert decision.overdue, "which is worth a word"


def test_a_later_answer_is_missed_at_the_deadline() -> None:
    lock = barrier("deputy1", "deputy2")
    for name in ("deputy1", "deputy2"):
        lock.answer(name, 0, FORCE)
    lock.open(TICK, 0.0)
    lock.answer("deputy2", TICK, FORCE)
    for now in np.linspace(0.0, DEADLINE, 9):
        lock.check(float(now))
    assert lock.decide(DEADLINE).waiting_for == ("deputy1",)
    lock.check(DEADLINE + 0.01)
    assert lock.decide(DEADLINE + 0.01) == ADVANCE
    assert lock.answers == {"deputy2": FORCE}
    assert lock.reason_of_miss("deputy1", ["/deputy1/estimate"]) == (
        "did not answer within 2 s (nobody publishes /deputy1/estimate)"
    )


def test_even_a_first_answer_is_not_awaited_for_ever() -> None:
    lock = barrier()
    for now in np.arange(0.0, DEADLINE + LONGEST_START, 0.5):
        lock.check(float(now))
    assert not lock.decide(DEADLINE + LONGEST_START).advance
    for now in (DEADLINE + LONGEST_START, DEADLINE + LONGEST_START + 0.1):
        lock.check(now)
    assert lock.decide(DEADLINE + LONGEST_START + 0.1) == ADVANCE


def test_time_in_which_the_plant_was_held_up_is_not_held_against_deputies() -> None:
    lock = barrier()
    lock.answer("deputy1", 0, FORCE)
    lock.open(TICK, 0.0)
    lock.check(0.0)
    lock.check(10.0)  # no processor for 10 s
    assert lock.decide(10.0).waiting_for == ("deputy1",)
    for now in np.arange(10.0, 10.0 + DEADLINE + LONGEST_CHECK_GAP + 0.2, 0.1):
        lock.check(float(now))
    assert lock.decide(13.0) == ADVANCE


def test_the_plant_stays_within_the_lag_of_a_recorder_that_is_there() -> None:
    lock = barrier()
    for tick in range(LAG + 1):
        lock.answer("deputy1", tick * TICK, FORCE)
        lock.open((tick + 1) * TICK, 0.0)
    lock.answer("deputy1", (LAG + 1) * TICK, FORCE)
    assert lock.decide(0.0) == ADVANCE, "without a recorder nobody waits"
    lock.has_recorder = True
    assert lock.decide(0.0).waiting_for == ("/recorder",)
    lock.recorded = TICK
    assert lock.decide(0.0) == ADVANCE
    assert not lock.recorder_is_done((LAG + 1) * TICK)
    lock.recorded = (LAG + 1) * TICK
    assert lock.recorder_is_done((LAG + 1) * TICK)


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_the_pace_is_kept_on_average(late: float) -> None:
    lock = barrier(period=0.5)
    lock.answer("deputy1", 0, FORCE)
    assert lock.decide(late).pause == pytest.approx(0.5 - late)
    assert lock.decide(0.5) == ADVANCE
    lock.open(TICK, 0.7)  # somewhat late
    lock.answer("deputy1", TICK, FORCE)
    assert lock.decide(0.7).pause == pytest.approx(0.3), "from the start of the run, not from the tick before"


class AnyInterleaving(RuleBasedStateMachine):
    """A plant, three deputies that may be dead, silent, late or started again, and a recorder that comes and goes."""

    def __init__(self) -> None:
        super().__init__()
        self.lock = TickBarrier(DEPUTIES, DEADLINE, LAG * TICK)
        self.now = self.opened = 0.0
        self.tick = 0
        self.flown: list[int] = []
        self.answered, self.missed, self.known = set[str](), set[str](), set[str]()
        self.lock.open(0, self.now)

    def advance(self) -> None:
        """As the plant does after everything that happens."""
        while self.lock.decide(self.now).advance:
            assert self.lock.answers.keys() == self.answered, "every answer counts, and no other"
            assert set(DEPUTIES) - self.answered <= self.missed, "nobody is missed before the deadline"
            self.flown.append(self.tick)
            self.tick += 1
            self.answered, self.missed, self.opened = set(), set(), self.now
            self.lock.open(self.tick * TICK, self.now)

    def answer_of(self, deputy: str, tick: int) -> None:
        counts = self.lock.answer(deputy, tick * TICK, FORCE)
        assert counts == (tick == self.tick and deputy not in self.answered | self.missed)
        if counts:
            self.answered.add(deputy)
            self.known.add(deputy)

    @rule(deputy=st.sampled_from(DEPUTIES), back=st.integers(-1, 2))
    def a_deputy_answers_this_tick_or_another(self, deputy: str, back: int) -> None:
        self.answer_of(deputy, self.tick - back)
        self.advance()

    @rule(seconds=st.sampled_from([0.0625, 0.375, 0.5, 3.0]))  # sums without rounding: the deadline is met exactly
    def time_passes(self, seconds: float) -> None:
        self.now += seconds
        self.opened += max(0.0, seconds - LONGEST_CHECK_GAP)
        self.lock.check(self.now)
        if self.now - self.opened > DEADLINE:
            self.missed |= self.known - self.answered
        self.advance()

    @rule()
    def a_recorder_comes(self) -> None:
        self.lock.has_recorder = True

    @rule()
    def the_recorder_dies(self) -> None:
        self.lock.has_recorder = False
        self.advance()

    @rule(behind=st.integers(0, LAG))
    def the_recorder_catches_up(self, behind: int) -> None:
        self.lock.recorded = max(self.lock.recorded or 0, (self.tick - behind) * TICK)
        self.advance()

    @rule()
    def everybody_answers_and_the_recorder_keeps_up(self) -> None:
        """No deadlock: from any state the tick in flight can be ended."""
        before = self.tick
        self.lock.recorded = self.tick * TICK
        for deputy in DEPUTIES:
            self.answer_of(deputy, before)
        self.advance()
        assert self.tick > before

    @invariant()
    def no_tick_is_flown_twice_or_left_out(self) -> None:
        assert self.flown == list(range(self.tick))

    @invariant()
    def the_recorder_is_never_left_behind(self) -> None:
        lock = self.lock
        if lock.has_recorder and lock.stamp > (lock.recorded or 0) + LAG * TICK:
            assert not lock.decide(self.now).advance


TestAnyInterleaving = AnyInterleaving.TestCase
TestAnyInterleaving.settings = settings(max_examples=200, stateful_step_count=40)
