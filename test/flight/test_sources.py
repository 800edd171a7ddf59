"""Several publishers of one topic: the one that is heard goes on to be, and the others are named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.flight.sources import UNKNOWN, SourceLock, is_shared, names_of, shared

TICK = 10**9


def flown(ticks: int, numbered: bool = True) -> SourceLock:
    """A lock that has heard a publisher's first ticks."""
    lock = SourceLock()
    for tick in range(ticks):
        assert lock.accepts(tick * TICK, tick + 1 if numbered else None, lambda: False)
    return lock


def test_alone_a_publisher_may_skip_go_back_and_begin_again() -> None:
    lock = flown(5)
    for tick, number in ((9, 6), (9, 6), (3, 7), (0, 1), (1, 2)):
        assert lock.accepts(tick * TICK, number, lambda: False)
    assert lock.ignored == 0


@pytest.mark.parametrize("numbered", [True, False])
def test_an_earlier_message_of_another_does_not_count(numbered: bool) -> None:
    lock = flown(5, numbered)
    assert not lock.accepts(0, 1 if numbered else None, lambda: True)
    assert lock.accepts(5 * TICK, 6 if numbered else None, lambda: True)
    assert lock.ignored == 1


@given(joined=st.integers(1, 60), bursts=st.lists(st.integers(0, 30), max_size=20))
def test_a_bag_of_the_same_ticks_that_is_played_into_a_flight_never_counts(joined: int, bursts: list[int]) -> None:
    """Also where it overtakes the flight; only a burst that ends level with it cannot be told from the flight."""
    lock, tick, played = flown(joined), joined, 0
    for burst in bursts:
        for _ in range(burst + (played + burst == tick)):
            assert not lock.accepts(played * TICK, played + 1, lambda: True)
            played += 1
        assert lock.accepts(tick * TICK, tick + 1, lambda: True)
        tick += 1
    assert lock.ignored == played


def test_one_that_is_started_again_counts_when_the_others_have_gone() -> None:
    lock = flown(5)
    for tick in range(3):
        assert not lock.accepts(tick * TICK, tick + 1, lambda: True)
    assert not lock.accepts(3 * TICK, 4, lambda: False), "what was on its way from them"
    for tick in range(3):
        assert lock.accepts(tick * TICK, tick + 1, lambda: False)
    for tick in range(3, 6):
        assert lock.accepts(tick * TICK, tick + 1, lambda: True)


def test_a_node_started_again_counts_before_its_name_is_known() -> None:
    lock = flown(5)
    for tick, second in (
        (9, f"/{UNKNOWN}"),
        (10, f"/{UNKNOWN}"),
        (11, "/deputy1/navigation"),
        (12, "/deputy1/navigation"),
    ):
        assert lock.accepts(tick * TICK, tick - 8, lambda second=second: is_shared(["/deputy1/navigation", second]))
    assert lock.ignored == 0


def test_a_stranger_without_a_name_yet_does_not_take_over() -> None:
    lock = flown(5)
    assert lock.accepts(90 * TICK, 1, lambda: is_shared(["/plant", f"/{UNKNOWN}"])), "as a plant that is started again"
    for tick in range(5, 9):
        assert lock.accepts(tick * TICK, tick + 1, lambda: True)
        assert not lock.accepts((86 + tick) * TICK, tick - 3, lambda: True)


def test_the_graph_is_asked_only_about_what_does_not_follow() -> None:
    lock = SourceLock()

    def unasked() -> bool:
        pytest.fail("asked")

    for tick in range(3):
        assert lock.accepts(tick * TICK, tick + 1, unasked)


def test_a_node_started_again_is_no_stranger_and_two_of_a_name_are_counted() -> None:
    assert not is_shared(["/plant", "/plant"])
    assert is_shared(["/plant", "/rosbag2_player"])
    assert names_of(["/b", "/a", "/b"]) == "/a and /b (2 times)"
    offers = {"/clock": ["/plant", "/plant"], "/truth": ["/plant"]}
    assert list(shared(("/clock", "/truth"), offers.__getitem__)) == [("/clock", "/plant (2 times)")]
