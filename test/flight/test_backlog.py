"""Which ticks a module answers that joins a flight in progress, or has been busy."""

from dataclasses import dataclass
from typing import Any

import pytest

from formation_gnc.flight.backlog import LATE, SETTLING, SOON, STALLED, Backlog
from formation_gnc.flight.graph import MODULES
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

START = 10**18  # ns of wall time, of the module
TICK = 1_000_000_000  # ns


@dataclass
class Stamped:
    """A record of which only the stamp counts."""

    time: int
    fix_available: bool = False
    fix: tuple[float, ...] = ()


class Flight:
    """A module, and what is published to it one tick after the other."""

    def __init__(self, name: str) -> None:
        self.instance = Run(load_scenario("leader_follower")).instances[f"/deputy1/{name}"]
        self.backlog = Backlog(self.instance, START)
        self.pace = self.instance.needed[0]
        self.now = START
        self.answered: list[int] = []
        self.lacking: list[list[int]] = []
        """Places of the inputs that were missing, by answer."""

    def take(self, topic: str, record: Any) -> None:
        inputs = self.instance.synchronizer.take(topic, record)
        while inputs is not None:
            self.answered.append(inputs[0].time // TICK)
            self.lacking.append([place for place, each in enumerate(inputs) if each is None])
            inputs = self.instance.synchronizer.next()

    def receive(self, tick: int, published: int, *topics: str) -> None:
        """Receive the records of a tick on some topics, all by default."""
        for topic in topics or self.instance.inputs:
            record = Stamped((tick - (topic in self.instance.delayed)) * TICK)
            if self.backlog.add(topic, record, published, self.now):
                self.take(topic, record)

    def wait(self) -> None:
        """Go on when the module does."""
        while self.backlog.due is not None:
            self.now = self.backlog.due
            for topic, record in self.backlog.take():
                self.take(topic, record)


@pytest.mark.parametrize("name", MODULES)
def test_what_comes_at_once_is_answered_at_once(name: str) -> None:
    flight = Flight(name)
    for tick in range(5, 10):
        flight.now = START + tick * TICK
        flight.receive(tick, flight.now - LATE + 1)
    assert flight.answered == [5, 6, 7, 8, 9]
    assert flight.backlog.due is None


@pytest.mark.parametrize("name", MODULES)
def test_of_what_was_before_its_start_it_answers_the_last_tick_only(name: str) -> None:
    flight = Flight(name)
    for tick in range(5, 10):
        flight.receive(tick, START - TICK)
    assert flight.answered == []
    assert flight.backlog.due == START + STALLED
    flight.wait()
    assert flight.answered == [9]


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.parametrize("part", [1, 3, 5])
def test_what_was_before_its_start_may_come_in_parts(name: str, part: int) -> None:
    """The first part alone may have a pacing message whose other inputs come with the second."""
    flight = Flight(name)
    for tick in range(5, 5 + part):
        flight.receive(tick, START - TICK, flight.pace)
    flight.wait()
    for tick in range(5, 20):
        flight.receive(tick, START - TICK, *(flight.instance.inputs.keys() - {flight.pace}))
        if tick >= 5 + part:
            flight.receive(tick, START - TICK, flight.pace)
    flight.receive(20, START + 1)
    flight.wait()
    assert flight.answered[-1] == 20
    assert set(flight.answered) <= {4 + part, 19, 20}, "of each part no tick but its last"
    assert flight.answered == sorted(flight.answered)


def test_it_goes_on_soon_after_a_message_from_after_its_start() -> None:
    flight = Flight("controller")
    flight.receive(5, START - TICK)
    flight.now += LATE - 1  # in time, but behind what waits
    flight.receive(6, START)
    assert flight.backlog.due == flight.now + SETTLING
    flight.wait()
    assert flight.answered == [6]


def test_supervision_answers_every_tick_from_after_its_start() -> None:
    flight = Flight("supervisor")
    for tick in range(5, 10):
        flight.receive(tick, START - TICK)
    flight.now += TICK
    for tick in range(10, 13):
        flight.receive(tick, START)
    flight.wait()
    assert flight.answered == [10, 11, 12]


def test_one_that_was_busy_goes_on_with_the_last_tick() -> None:
    flight = Flight("controller")
    flight.now += 5 * TICK
    flight.receive(5, flight.now)
    for tick in (6, 7, 8):
        flight.receive(tick, flight.now - LATE)
    assert flight.backlog.due == flight.now + SOON
    flight.wait()
    assert flight.answered == [5, 8]


@pytest.mark.parametrize("started", [START - TICK, START + 1], ids=["before it starts", "after"])
def test_supervision_that_comes_late_answers_a_flight_from_its_first_tick(started: int) -> None:
    """The others wait at the second tick for its answer to the first."""
    flight = Flight("supervisor")
    flight.receive(0, START - TICK, flight.pace)
    flight.receive(1, started)
    flight.wait()
    assert flight.answered == [0, 1]


def test_supervision_waits_for_a_tick_begun_while_others_are_further() -> None:
    """What is published at the first tick may come late, when its publisher is found late."""
    flight = Flight("supervisor")
    delayed = flight.instance.delayed
    flight.receive(0, START, flight.pace)
    flight.now += LATE
    flight.receive(1, flight.now, flight.pace)
    flight.receive(2, flight.now, flight.pace)
    flight.wait()
    assert flight.answered == [0]
    flight.receive(1, START, *delayed)
    flight.receive(2, flight.now, *delayed)
    flight.wait()
    assert flight.answered == [0, 1, 2]
    assert flight.lacking == [[1, 2, 3, 4], [], []]


def test_supervision_started_again_waits_for_what_the_others_published() -> None:
    """It goes on with the mode that the controller obeys, which the status of the tick before tells."""
    flight = Flight("supervisor")
    flight.receive(8, START - TICK, flight.pace)
    flight.wait()
    flight.now += TICK
    flight.receive(9, START + 1, flight.pace)
    flight.receive(9, START + 1, *flight.instance.delayed)
    flight.wait()
    assert (flight.answered, flight.lacking) == ([9], [[]])


def test_nothing_is_awaited_that_a_lagging_module_has_left_out() -> None:
    """Nothing that it left out is waited for: the last tick of a flight has no successor that would end the wait."""
    flight = Flight("supervisor")
    flight.instance.module.first_of = lambda waiting: waiting[-1]
    flight.receive(0, START)
    flight.receive(1, START, flight.pace)
    flight.now += 2 * LATE
    flight.receive(2, START)
    flight.wait()
    assert (flight.answered, flight.lacking[-1]) == ([0, 2], [])
