"""Lost messages, counted by publisher."""

from itertools import count

from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.recording.loss import LossCounter


@given(st.lists(st.booleans(), min_size=1, max_size=50))
def test_gaps_of_a_publisher_are_counted_up_to_its_last_arrival(arrives: list[bool]) -> None:
    loss = LossCounter(from_the_first=True)
    missed = [loss.take(b"one", number) for number, comes in zip(count(1), arrives, strict=False) if comes]
    came = len(missed)
    last = max((number for number, comes in enumerate(arrives, 1) if comes), default=0)
    assert loss.lost == sum(missed) == last - came


@given(st.lists(st.tuples(st.sampled_from([b"one", b"two", b"three"]), st.booleans()), max_size=60))
def test_gaps_of_several_publishers_are_those_of_each_by_itself(sent: list[tuple[bytes, bool]]) -> None:
    together, number = LossCounter(from_the_first=True), dict.fromkeys((b"one", b"two", b"three"), 0)
    alone = {publisher: LossCounter(from_the_first=True) for publisher in number}
    for publisher, comes in sent:
        number[publisher] += 1
        if comes:
            assert together.take(publisher, number[publisher]) == alone[publisher].take(publisher, number[publisher])
    assert together.lost == sum(each.lost for each in alone.values())


def test_earlier_messages_are_lost_only_on_latched_topics() -> None:
    assert LossCounter(from_the_first=True).take(b"one", 101) == 100
    assert LossCounter(from_the_first=False).take(b"one", 101) == 0


def test_a_restarted_node_is_another_publisher_and_loses_nothing() -> None:
    loss = LossCounter(from_the_first=True)
    taken = [loss.take(*each) for each in ((b"one", 1), (b"one", 2), (b"two", 1), (b"two", 2))]
    assert taken == [0, 0, 0, 0]
