"""Grouping of records by stamp in any order of arrival, with topics that fall silent and resume."""

from dataclasses import dataclass
from itertools import permutations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.flight.synchronizer import InputTopics, StampSynchronizer

OWN, SECOND, THIRD = "estimate", "/deputy2/estimate", "/deputy3/estimate"


@dataclass
class At:
    time: int
    run: int = 1


@pytest.fixture
def fleet() -> StampSynchronizer:
    """A satellite's own estimate, needed, and those of two neighbours, optional."""
    return StampSynchronizer(InputTopics((OWN,), optional=(SECOND, THIRD)))


def taken(synchronizer: StampSynchronizer, topic: str, record: At) -> list[Any]:
    """Groups returned for the arrival of a record."""
    found = [synchronizer.take(topic, record)]
    while found[-1] is not None:
        found.append(synchronizer.next())
    return found[:-1]


def groups(synchronizer: StampSynchronizer, *arrivals: tuple[str, int]) -> list[list[int | None]]:
    """Stamps of the groups returned for arrivals of (topic, stamp)."""
    found = [records for topic, time in arrivals for records in taken(synchronizer, topic, At(time))]
    return [[each and each.time for each in records] for records in found]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
def test_any_order_of_arrival_gives_one_group_per_stamp(fleet: StampSynchronizer, order: tuple[str, ...]) -> None:
    arrivals = [(topic, time) for time in (10, 20) for topic in order]
    assert groups(fleet, *arrivals) == [[10, 10, 10], [20, 20, 20]]


def test_repeated_record_gives_no_second_group(fleet: StampSynchronizer) -> None:
    assert len(groups(fleet, (SECOND, 10), (THIRD, 10), (OWN, 10), (OWN, 10), (SECOND, 10))) == 1


def test_silent_topic_delays_the_others_by_one_tick_only(fleet: StampSynchronizer) -> None:
    assert groups(fleet, (OWN, 10), (SECOND, 10)) == []
    # at the next stamp the third is missing, and the second still waited for
    assert groups(fleet, (OWN, 20)) == []
    assert groups(fleet, (SECOND, 20)) == [[20, 20, None]]
    assert groups(fleet, (SECOND, 30), (OWN, 30)) == [[30, 30, None]]


def test_topic_that_resumes_is_waited_for_again(fleet: StampSynchronizer) -> None:
    groups(fleet, (OWN, 10), (SECOND, 10), (OWN, 20), (SECOND, 20))
    assert groups(fleet, (THIRD, 10)) == []  # of an old stamp: still missing
    assert groups(fleet, (OWN, 30), (SECOND, 30)) == [[30, 30, None]]
    assert groups(fleet, (THIRD, 30), (OWN, 40), (SECOND, 40)) == []
    assert groups(fleet, (THIRD, 40)) == [[40, 40, 40]]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
def test_order_of_arrival_does_not_matter_after_a_silence(fleet: StampSynchronizer, order: tuple[str, ...]) -> None:
    groups(fleet, (OWN, 10), (SECOND, 10), (THIRD, 10), (OWN, 20), (THIRD, 20))
    assert groups(fleet, *((topic, 30) for topic in order)) == [[30, None, 30]]
    assert groups(fleet, *((topic, 40) for topic in order)) == [[40, 40, 40]]


def test_needed_topic_is_always_waited_for() -> None:
    pair = StampSynchronizer(InputTopics(("estimate", "target")))
    assert pair.unanswered is None
    assert groups(pair, ("estimate", 10), ("estimate", 20), ("estimate", 30)) == []
    assert groups(pair, ("target", 30)) == [[30, 30]]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
@pytest.mark.parametrize("last", [{OWN, SECOND, THIRD}, {OWN, SECOND}, {OWN}])
def test_new_run_gets_no_record_of_the_previous_one(
    fleet: StampSynchronizer, order: tuple[str, ...], last: set[str]
) -> None:
    """With all topics, one or none of the optional ones at the last stamp of the previous run."""
    for time in (0, 10, 20):
        for topic in order if time < 20 else sorted(last):
            fleet.take(topic, At(time))
    for time in (0, 10, 20, 30):
        now = At(time, run=2)
        assert [fleet.take(topic, now) for topic in order] == [None, None, [now] * 3]


# --- inputs of the tick before

MODE = "mode"


def delayed(**changes: Any) -> StampSynchronizer:
    return StampSynchronizer(InputTopics((OWN,), (MODE,), delay=10, **changes))


def test_delayed_topic_is_taken_of_the_tick_before() -> None:
    assert groups(delayed(), (OWN, 0), (MODE, 0), (OWN, 10), (MODE, 10), (OWN, 20)) == [[0, None], [10, 0], [20, 10]]


def test_delayed_topic_is_waited_for() -> None:
    waiting = delayed()
    assert groups(waiting, (OWN, 0), (OWN, 10)) == [[0, None]]
    assert groups(waiting, (MODE, 0)) == [[10, 0]]


def test_delayed_topic_that_falls_silent_delays_one_tick_only() -> None:
    silent = delayed()
    assert groups(silent, (OWN, 0), (MODE, 0), (OWN, 10), (OWN, 20)) == [[0, None], [10, 0]]
    # what was late for its tick counts for none
    assert groups(silent, (OWN, 30), (MODE, 20)) == [[30, None]]
    assert groups(silent, (MODE, 30), (OWN, 40), (MODE, 40), (OWN, 50)) == [[40, 30], [50, 40]]


def test_restarted_reader_waits_for_the_tick_before() -> None:
    assert groups(delayed(), (OWN, 50), (MODE, 40)) == [[50, 40]]


def test_delayed_topics_are_there_where_the_pacing_record_says_so() -> None:
    told = delayed(has_delayed=lambda record: record.run != 2)
    assert told.take(OWN, At(0)) == [At(0), None]
    assert told.take(MODE, At(0)) is None
    assert told.take(OWN, At(10, run=2)) == [At(10, run=2), None]
    assert told.take(OWN, At(20)) is None  # it was not missed at 10
    assert told.take(MODE, At(10)) == [At(20), At(10)]


def test_topic_that_nobody_has_is_not_waited_for() -> None:
    assert groups(delayed(without=frozenset({MODE})), (OWN, 0), (OWN, 10)) == [[0, None], [10, None]]


TICKS = st.lists(st.sets(st.sampled_from((OWN, SECOND, THIRD, MODE))), max_size=12)


@given(TICKS)
def test_whole_ticks_are_taken_as_record_by_record(ticks: list[set[str]]) -> None:
    topics = InputTopics((OWN,), (MODE,), (SECOND, THIRD), delay=10)
    single, whole = StampSynchronizer(topics), StampSynchronizer(topics)
    before: dict[str, At] = {}
    for number, given_topics in enumerate(ticks):
        records = {topic: At(10 * number) for topic in given_topics}
        order = sorted(records, key=(OWN, SECOND, THIRD, MODE).index)
        ones = [each for topic in order for each in taken(single, topic, records[topic])]
        expected = whole.take_tick(records, before)
        has_resumed = MODE in records and MODE not in before  # known only where records come one by one
        if expected is not None or not has_resumed:
            assert ones == ([] if expected is None else [expected])
        before = records


def test_a_tick_is_unanswered_until_the_last_of_its_records_is_there() -> None:
    """Whoever catches up may not leave out what that tick awaits."""
    pair = delayed()
    pair.take(OWN, At(10))
    begun = pair.unanswered
    assert begun is not None
    assert begun.time == 10
    pair.take(MODE, At(0))
    assert pair.unanswered is None


# --- a topic of the tick before that has come further

LAGGING: dict[str, Any] = {"may_lag": True}


def test_delayed_topic_that_has_come_further_is_missing() -> None:
    """A node that was started again does not publish what the one before did not."""
    passed = delayed()
    assert groups(passed, (OWN, 0), (MODE, 0), (OWN, 10), (OWN, 20)) == [[0, None], [10, 0]]
    assert groups(passed, (MODE, 20)) == [[20, None]]
    assert groups(passed, (OWN, 30), (OWN, 40), (MODE, 30)) == [[30, None], [40, 30]]


def test_who_may_lag_waits_while_the_pacing_topic_is_one_tick_further() -> None:
    """A reader that the middleware matches late has the records of the tick before after the next measurement."""
    lagging = delayed(**LAGGING)
    assert groups(lagging, (OWN, 0), (OWN, 10), (OWN, 20)) == [[0, None]]
    assert groups(lagging, (MODE, 0), (MODE, 10)) == [[10, 0], [20, 10]]


def test_who_may_lag_answers_every_tick_without_what_does_not_come() -> None:
    lagging = delayed(**LAGGING)
    assert groups(lagging, (OWN, 0), (OWN, 10), (OWN, 20)) == [[0, None]]
    assert groups(lagging, (OWN, 30), (OWN, 40)) == [[10, None], [20, None], [30, None], [40, None]]
    # what was silent is waited for again from the tick after it resumed
    assert groups(lagging, (MODE, 40), (OWN, 50), (OWN, 60)) == [[50, None]]
    assert groups(lagging, (MODE, 50)) == [[60, 50]]


def test_who_may_lag_is_not_held_up_by_a_record_that_comes_twice() -> None:
    lagging = delayed(**LAGGING)
    arrivals = [(OWN, 0), (OWN, 10), (OWN, 20), (OWN, 10), (MODE, 0), (MODE, 10)]
    assert groups(lagging, *arrivals) == [[0, None], [10, 0], [20, 10]]


def test_a_new_run_leaves_nothing_ahead() -> None:
    lagging = delayed(**LAGGING)
    assert groups(lagging, (OWN, 0), (MODE, 0), (OWN, 10), (OWN, 20), (OWN, 30)) == [[0, None], [10, 0]]
    assert groups(lagging, (OWN, 0), (OWN, 10), (MODE, 0)) == [[0, None], [10, 0]]


def test_needed_topic_that_was_left_out_is_no_tick_of_who_may_lag() -> None:
    pair = StampSynchronizer(InputTopics(("estimate", "target"), delay=10, may_lag=True))
    assert groups(pair, ("estimate", 0), ("estimate", 10), ("target", 10)) == []
    assert groups(pair, ("estimate", 20)) == [[10, 10]]
    assert groups(pair, ("target", 20)) == [[20, 20]]


def test_a_tick_that_is_abandoned_is_not_answered() -> None:
    left = delayed()
    left.take(OWN, At(10))
    left.abandon()
    assert left.unanswered is None
    assert groups(left, (MODE, 0), (OWN, 20), (MODE, 10)) == [[20, 10]]


@given(st.lists(st.sampled_from((OWN, MODE)), max_size=30), st.booleans())
def test_every_tick_is_answered_in_order_however_topics_interleave(order: list[str], may_lag: bool) -> None:
    """By who may lag; the tick before is there whenever it came before the one after next."""
    synchronizer, stamps = delayed(may_lag=may_lag), dict.fromkeys((OWN, MODE), 0)
    answered: list[int] = []
    for topic in order:
        for records in taken(synchronizer, topic, At(stamps[topic])):
            answered.append(records[0].time)
            assert records[1] is None or records[1].time == records[0].time - 10
        stamps[topic] += 10
    if may_lag:
        assert answered == list(range(0, 10 * len(answered), 10))
        assert len(answered) >= stamps[OWN] // 10 - 2
    else:
        assert answered == sorted(set(answered))


def test_what_is_left_of_the_run_before_tells_nothing_of_this_one() -> None:
    """A module that was started between two runs has the records of the first before it has any of the second."""
    restarted = delayed()
    assert groups(restarted, *((MODE, time) for time in range(0, 60, 10)), (OWN, 0), (OWN, 10)) == [[0, None]]
    assert groups(restarted, (MODE, 0)) == [[10, 0]]


def test_who_may_lag_waits_no_longer_once_told_that_a_tick_was_missed() -> None:
    told = delayed(has_delayed=lambda record: record.run != 2, **LAGGING)
    told.take(OWN, At(0))
    assert told.take(OWN, At(10)) is None
    assert told.take(OWN, At(20, run=2)) == [At(10), None]
    assert told.next() == [At(20, run=2), None]
    assert told.next() is None


def test_a_record_that_a_bag_lacks_is_not_given_up() -> None:
    """Who answered with it in flight is not flown again without."""
    lagging = delayed(**LAGGING)
    assert lagging.take_tick({OWN: At(0)}, {}, [1]) == [At(0), None]
    assert lagging.take_tick({OWN: At(10)}, {}, []) is None
