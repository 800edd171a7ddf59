"""How far a recording is, whatever the order in which topics come."""

from itertools import permutations

from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.flight import topics
from formation_gnc.recording.progress import LONGEST_TICK, RecordingProgress
from formation_gnc.records import Event, EventKind

PLANT = (topics.CLOCK.name, topics.TRUTH.name)
DEPUTIES = ("deputy1", "deputy2")
MEASUREMENTS = tuple(topics.MEASUREMENT.of(name) for name in DEPUTIES)
GIVEN = (topics.ESTIMATE, topics.TARGET, topics.THRUST, topics.MODE)
ANSWERS = tuple(topic.of(name) for name in DEPUTIES for topic in GIVEN)
TICK = (*PLANT, *MEASUREMENTS, *ANSWERS)


def miss(stamp: int, deputy: str) -> Event:
    return Event(stamp, stamp, "/plant", EventKind.MISS, deputy)


def end(stamp: int) -> Event:
    return Event(stamp, stamp, "/plant", EventKind.END)


def recorded(*ticks: int) -> RecordingProgress:
    """Everything of these ticks has come."""
    progress = RecordingProgress()
    for tick in ticks:
        for topic in TICK:
            progress.take(topic, tick)
    return progress


def test_a_tick_is_recorded_when_its_last_message_has_come() -> None:
    for last in TICK:
        progress = recorded(0)
        for topic in TICK:
            if topic != last:
                progress.take(topic, 1)
        assert progress.stamp == 0, last
        assert progress.lacking == [last]
        progress.take(last, 1)
        assert progress.lacking == []
        assert progress.stamp == 1


def test_what_holds_the_recording_up_is_awaited_once_it_has_for_long() -> None:
    progress = recorded(0)
    for topic in TICK:
        if topic != ANSWERS[0]:
            progress.take(topic, 1)
    assert progress.awaited(10.0) == []
    assert progress.awaited(10.0 + LONGEST_TICK) == []
    assert progress.awaited(10.1 + LONGEST_TICK) == [ANSWERS[0]]
    progress.take(ANSWERS[0], 1)
    assert progress.awaited(100.0) == []
    assert progress.awaited(200.0) == [], "nothing is lacking between two ticks, however long they are apart"


def test_a_miss_counts_instead_of_the_answers() -> None:
    progress = recorded(0)
    for topic in (*PLANT, *MEASUREMENTS, *(each for each in ANSWERS if "deputy1" in each)):
        progress.take(topic, 1)
    assert progress.stamp == 0
    progress.take_event(miss(1, "deputy2"))
    assert progress.stamp == 1


def test_a_supervisor_that_died_holds_nothing_up_after_the_tick_it_costs() -> None:
    progress = recorded(0)
    for tick in (1, 2):
        for topic in TICK:
            if topic != topics.MODE.of("deputy1"):
                progress.take(topic, tick)
    assert progress.stamp == 0
    progress.take_event(miss(2, "deputy1"))
    assert progress.stamp == 2
    for topic in TICK:
        if topic != topics.MODE.of("deputy1"):
            progress.take(topic, 3)
    assert progress.stamp == 3


def test_the_end_of_the_run_counts_when_all_else_has_come() -> None:
    progress = recorded(0, 1)
    progress.take_event(end(2))
    assert progress.stamp == 2
    behind = recorded(0)
    behind.take(topics.CLOCK.name, 1)
    behind.take_event(end(2))
    assert behind.stamp == 0


def test_a_plant_started_again_starts_progress_again() -> None:
    progress = recorded(0, 1, 2)
    progress.take(topics.CLOCK.name, 0)
    for order in permutations((topics.TRUTH.name, *MEASUREMENTS)):
        for topic in order:
            progress.take(topic, 0)
    assert progress.stamp == -1, "the answers of the run before do not count"
    for topic in ANSWERS:
        progress.take(topic, 0)
    assert progress.stamp == 0


def test_time_of_another_publisher_does_not_start_progress_again() -> None:
    progress = recorded(0, 1, 2)
    for stamp in (0, 1):
        for topic in TICK:
            progress.take(topic, stamp, lambda: 2)
    assert progress.stamp == 2
    for topic in TICK:
        progress.take(topic, 3, lambda: 2)
    assert progress.stamp == 3


def test_an_event_of_others_is_neither_miss_nor_end() -> None:
    progress = recorded(0)
    for kind in (EventKind.MISS, EventKind.END):
        progress.take_event(Event(10**18, 0, "/somebody", kind, "deputy1"))
    assert progress.stamp == 0


@settings(deadline=None)
@given(st.permutations([(topic, tick) for topic in TICK for tick in range(4)]))
def test_progress_never_runs_ahead_of_a_topic(arrivals: list[tuple[str, int]]) -> None:
    """Topics keep their own order; between topics any order is possible."""
    streams: dict[str, list[int]] = {topic: [] for topic in TICK}
    order = [topic for topic, _ in arrivals]
    progress, before = RecordingProgress(), -1
    for topic in order:
        streams[topic].append(len(streams[topic]))
        progress.take(topic, streams[topic][-1])
        if all(streams[each] for each in TICK):  # all publishers are known
            assert before <= progress.stamp <= min(ticks[-1] for ticks in streams.values())
            before = progress.stamp
    assert progress.stamp == 3
