"""Lost messages, counted by the numbers of several publishers that nobody tells apart."""

from itertools import count

from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.recording.loss import LossCounter


def counter(publishers: int = 1, from_the_first: bool = True) -> LossCounter:
    return LossCounter(lambda: publishers, from_the_first)


@given(st.lists(st.booleans(), min_size=1, max_size=50))
def test_one_publishers_gaps_are_counted_up_to_its_last_message_that_came(arrives: list[bool]) -> None:
    loss = counter()
    missed = [loss.take(number) for number, comes in zip(count(1), arrives, strict=False) if comes]
    came = len(missed)
    last = max((number for number, comes in enumerate(arrives, 1) if comes), default=0)
    assert loss.lost == sum(missed) == last - came


@given(st.lists(st.integers(0, 3), max_size=60))
def test_publishers_that_take_turns_in_any_order_lose_nothing(order: list[int]) -> None:
    loss, said = counter(publishers=4), [0, 0, 0, 0]
    for who in order:
        said[who] += 1
        assert loss.take(said[who]) == 0


@given(st.lists(st.integers(0, 2), min_size=30, max_size=60), st.integers(15, 29), st.integers(1, 4))
def test_a_gap_among_several_publishers_is_counted_once(order: list[int], at: int, gap: int) -> None:
    loss, said = counter(publishers=3), [0, 0, 0]
    for who in range(3):  # all have been heard
        said[who] += 1
        loss.take(said[who])
    for place, who in enumerate(order):
        # only the publisher that is ahead can be told to have left something out
        if place == at:
            who = said.index(max(said))
            said[who] += gap
        said[who] += 1
        loss.take(said[who])
    assert loss.lost == gap


def test_what_was_said_before_is_lost_only_where_it_would_have_been_kept() -> None:
    assert counter(from_the_first=True).take(101) == 100
    assert counter(from_the_first=False).take(101) == 0


def test_a_publisher_started_again_loses_nothing() -> None:
    loss = counter()
    for number in (1, 2, 3, 1, 2):
        assert loss.take(number) == 0
