"""Lost messages, counted by the numbers of publishers that cannot be told apart."""

from itertools import count

from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.recording.loss import LossCounter


def counter(publishers: int = 1, from_the_first: bool = True) -> LossCounter:
    return LossCounter(lambda: publishers, from_the_first)


@settings(deadline=None)
@given(st.lists(st.booleans(), min_size=1, max_size=50))
def test_gaps_of_a_publisher_are_counted_up_to_its_last_arrival(arrives: list[bool]) -> None:
    loss = counter()
    missed = [loss.take(number) for number, comes in zip(count(1), arrives, strict=False) if comes]
    came = len(missed)
    last = max((number for number, comes in enumerate(arrives, 1) if comes), default=0)
    assert loss.lost == sum(missed) == last - came


@settings(deadline=None)
@given(st.lists(st.integers(0, 3), max_size=60))
def test_interleaved_publishers_lose_nothing(order: list[int]) -> None:
    loss, sent = counter(publishers=4), [0, 0, 0, 0]
    for publisher in order:
        sent[publisher] += 1
        assert loss.take(sent[publisher]) == 0


@settings(deadline=None)
@given(st.lists(st.integers(0, 2), min_size=30, max_size=60), st.integers(15, 29), st.integers(1, 4))
def test_a_gap_among_several_publishers_is_counted_once(order: list[int], at: int, gap: int) -> None:
    loss, sent = counter(publishers=3), [0, 0, 0]
    for publisher in range(3):  # every publisher is known
        sent[publisher] += 1
        loss.take(sent[publisher])
    for place, publisher in enumerate(order):
        # only a gap of the publisher that is ahead can be detected
        if place == at:
            publisher = sent.index(max(sent))
            sent[publisher] += gap
        sent[publisher] += 1
        loss.take(sent[publisher])
    assert loss.lost == gap


def test_earlier_messages_are_lost_only_on_latched_topics() -> None:
    assert counter(from_the_first=True).take(101) == 100
    assert counter(from_the_first=False).take(101) == 0


def test_a_restarted_publisher_loses_nothing() -> None:
    loss = counter()
    for number in (1, 2, 3, 1, 2):
        assert loss.take(number) == 0
