"""What belongs to one stamp comes together, whatever the order in which it arrives."""

from dataclasses import dataclass
from itertools import permutations

import pytest

from formation_gnc.flight.synchronizer import StampSynchronizer
from formation_gnc.transport.bus import IntraProcessBus

OWN, SECOND, THIRD = "estimate", "/deputy2/estimate", "/deputy3/estimate"


@dataclass
class At:
    time: int
    run: int = 1


@pytest.fixture
def fleet() -> StampSynchronizer:
    """A satellite and two others, whom it can do without."""
    return StampSynchronizer((OWN, SECOND, THIRD), needed=1)


def answers(meeting: StampSynchronizer, *arrivals: tuple[str, int]) -> list[list[int | None]]:
    """The stamps of what was put together, each time it was."""
    came = [meeting.take(topic, At(time)) for topic, time in arrivals]
    return [[each and each.time for each in records] for records in came if records is not None]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
def test_any_order_of_arrival_gives_one_answer_per_stamp(fleet: StampSynchronizer, order: tuple[str, ...]) -> None:
    arrivals = [(topic, time) for time in (10, 20) for topic in order]
    assert answers(fleet, *arrivals) == [[10, 10, 10], [20, 20, 20]]


def test_a_repeated_record_is_not_answered_again(fleet: StampSynchronizer) -> None:
    assert len(answers(fleet, (SECOND, 10), (THIRD, 10), (OWN, 10), (OWN, 10), (SECOND, 10))) == 1


def test_who_is_silent_costs_one_tick_and_is_then_done_without(fleet: StampSynchronizer) -> None:
    assert answers(fleet, (OWN, 10), (SECOND, 10)) == []
    # the run goes on: the third was missing, the second was not, and is waited for
    assert answers(fleet, (OWN, 20)) == []
    assert answers(fleet, (SECOND, 20)) == [[20, 20, None]]
    assert answers(fleet, (SECOND, 30), (OWN, 30)) == [[30, 30, None]]


def test_who_speaks_again_is_waited_for_again(fleet: StampSynchronizer) -> None:
    answers(fleet, (OWN, 10), (SECOND, 10), (OWN, 20), (SECOND, 20))
    assert answers(fleet, (THIRD, 10)) == []  # of long ago: still lost
    assert answers(fleet, (OWN, 30), (SECOND, 30)) == [[30, 30, None]]
    assert answers(fleet, (THIRD, 30), (OWN, 40), (SECOND, 40)) == []
    assert answers(fleet, (THIRD, 40)) == [[40, 40, 40]]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
def test_the_tick_after_a_silence_does_not_hang_on_the_order_either(
    fleet: StampSynchronizer, order: tuple[str, ...]
) -> None:
    answers(fleet, (OWN, 10), (SECOND, 10), (THIRD, 10), (OWN, 20), (THIRD, 20))
    assert answers(fleet, *((topic, 30) for topic in order)) == [[30, None, 30]]
    assert answers(fleet, *((topic, 40) for topic in order)) == [[40, 40, 40]]


def test_what_is_needed_is_never_done_without() -> None:
    pair = StampSynchronizer(("estimate", "target"), needed=2)
    assert answers(pair, ("estimate", 10), ("estimate", 20), ("estimate", 30)) == []
    assert answers(pair, ("target", 30)) == [[30, 30]]


@pytest.mark.parametrize("order", list(permutations((OWN, SECOND, THIRD))))
@pytest.mark.parametrize("last", [{OWN, SECOND, THIRD}, {OWN, SECOND}, {OWN}])
def test_a_new_run_hears_nothing_of_the_one_before(
    fleet: StampSynchronizer, order: tuple[str, ...], last: set[str]
) -> None:
    """Wherever that one was left: with everybody there, with one lost, or with none at its last stamp."""
    for time in (0, 10, 20):
        for topic in order if time < 20 else sorted(last):
            fleet.take(topic, At(time))
    for time in (0, 10, 20, 30):
        now = At(time, run=2)
        assert [fleet.take(topic, now) for topic in order] == [None, None, [now] * 3]


def test_wires_hand_on_in_the_order_of_speech_and_to_the_last_listener_first() -> None:
    bus, heard = IntraProcessBus(), list[tuple[str, int]]()
    bus.advertise("estimate")
    bus.subscribe("estimate", lambda record: heard.append(("guidance", record)))
    bus.subscribe("estimate", lambda record: heard.append(("controller", record)))
    assert "estimate" in bus
    assert "target" not in bus
    bus.publish("estimate", 1)
    bus.publish("estimate", 2)
    assert heard == []
    bus.deliver()
    assert heard == [("controller", 1), ("guidance", 1), ("controller", 2), ("guidance", 2)]
