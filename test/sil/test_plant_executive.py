"""The plant's side of a run without processes: who is awaited, what is said and published, the end."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import RecorderLostError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import COMMAND, GRAPH
from formation_gnc.records import EventKind, Thrust
from formation_gnc.sil.plant_executive import STALLED, PlantExecutive, Report
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.sil.simulation import RECORDER_LAG

TICKS = 10
EVERYBODY = {row.answer.of("deputy1") for row in GRAPH}
ANSWERS = ", ".join(f"{row.answer.of('deputy1')} ({row.name})" for row in list(GRAPH)[:3])


class Graph:
    """Surroundings of an executive: who is there, and what it published, said and reported."""

    def __init__(self) -> None:
        self.published = set[str]()
        self.recorder = self.listens = False
        self.others: dict[str, list[str]] = {}
        self.messages: list[tuple[str, Any]] = []
        self.said: list[str] = []
        self.reports: list[Report] = []

    def publishers_of(self, topic: str) -> list[str]:
        own = {
            "/clock": "/plant",
            "/truth": "/plant",
            "/deputy1/measurement": "/plant",
            "/recorder/progress": "/recorder",
        }
        own |= dict.fromkeys(self.published, "/deputy1/module")
        return [*([own[topic]] if topic in own else []), *self.others.get(topic, [])]

    def has_recorder(self) -> bool:
        return self.recorder

    def recorder_listens(self) -> bool:
        return self.listens

    def publish(self, topic: str, record: Any) -> None:
        self.messages.append((topic, record))

    def log(self, text: str) -> None:
        self.said.append(text)

    def report(self, report: Report) -> None:
        self.reports.append(report)

    def of(self, topic: str) -> Iterator[Any]:
        return (record for name, record in self.messages if name == topic)

    def events(self, kind: EventKind) -> list[Any]:
        return [event for event in self.of(topics.EVENTS.name) if event.kind == kind]


def start(graph: Graph, ticks: int = TICKS, **plant: Any) -> PlantExecutive:
    """An executive on the default scenario that has looked around once."""
    values = {"duration": float(ticks), "deadline": 2.0} | plant
    executive = PlantExecutive(load_scenario("leader_follower", {"/plant": values}).plant, graph)
    executive.check(0.0)
    return executive


def answer(executive: PlantExecutive, now: float, force: float = 0.0) -> None:
    """deputy1 answers the tick in flight."""
    stamp = executive.simulation.plant.time
    executive.answer("deputy1", Thrust(stamp, np.full(3, force)), now)


@pytest.fixture
def graph() -> Graph:
    return Graph()


@pytest.fixture
def complete(graph: Graph) -> Graph:
    graph.published = set(EVERYBODY)
    return graph


def test_of_many_topics_without_publisher_three_are_named(graph: Graph) -> None:
    fleet = load_scenario("tetrahedral", {"/plant": {"duration": 3.0}}).plant
    PlantExecutive(fleet, graph).check(0.0)
    assert graph.said == [f"waiting for a publisher of {ANSWERS} and {4 * len(GRAPH) - 3} more"]


def test_the_run_starts_when_every_answer_has_a_publisher(graph: Graph) -> None:
    executive = start(graph)
    assert graph.said == [f"waiting for a publisher of {ANSWERS} and {len(GRAPH) - 3} more"]
    graph.published = EVERYBODY - {COMMAND.of("deputy1")}
    executive.check(0.1)
    assert graph.said[-1] == "waiting for a publisher of /deputy1/thrust (controller)"
    assert not graph.messages
    graph.published = set(EVERYBODY)
    executive.check(0.2)
    assert graph.said[-1] == "flying"
    names = [name for name, _ in graph.messages]
    assert names == [topics.MEASUREMENT.of("deputy1"), topics.TRUTH.name, topics.CLOCK.name]


def test_the_run_waits_for_a_recorder_that_knows_everything(complete: Graph) -> None:
    executive = start(complete, wait_for_recorder=True)
    assert complete.said == ["waiting for /recorder"]
    complete.recorder = complete.listens = True
    executive.check(0.1)
    assert not complete.messages, "it has subscribed, but not said that it knows the parameters"
    executive.recorded(-1, 0.2)
    executive.check(0.3)
    assert executive.simulation.has_begun


def test_each_answer_flies_a_tick_and_the_last_ends_the_run(complete: Graph) -> None:
    executive = start(complete)
    for _ in range(TICKS):
        answer(executive, 1.0)
    assert executive.finished
    assert executive.check(1.0)
    assert [clock.time for clock in complete.of(topics.CLOCK.name)] == [tick * 10**9 for tick in range(TICKS)]
    (end,) = complete.events(EventKind.END)
    assert (end.tick, end.detail) == (TICKS, f"{TICKS} ticks flown, 0 missed")
    assert complete.reports[-1].message == "finished"
    assert complete.reports[-1].figures["speedup"] == pytest.approx(TICKS / 1.0)
    answer(executive, 1.0)
    assert len(complete.events(EventKind.END)) == 1, "what comes after the end changes nothing"


def test_a_miss_is_told_with_its_reason_and_what_nobody_publishes(complete: Graph) -> None:
    executive = start(complete)
    answer(executive, 0.0)
    complete.published.discard(topics.ESTIMATE.of("deputy1"))
    for now in np.arange(0.0, 2.2, 0.1):
        executive.check(float(now))
    (miss,) = complete.events(EventKind.MISS)
    assert miss.subject == "deputy1"
    assert miss.detail == "did not answer within 2 s (nobody publishes /deputy1/estimate): no thrust"
    assert executive.simulation.misses == 1


def test_a_force_that_is_not_finite_is_a_miss(complete: Graph) -> None:
    executive = start(complete)
    answer(executive, 0.0, np.nan)
    (miss,) = complete.events(EventKind.MISS)
    assert miss.detail == "commanded [nan, nan, nan] N: no thrust"


def test_a_recorder_that_lags_holds_the_plant_and_is_named(complete: Graph) -> None:
    complete.recorder = True
    executive = start(complete, ticks=2 * RECORDER_LAG)
    executive.recorded(0, 0.0)
    executive.check(0.0)
    for _ in range(2 * RECORDER_LAG):
        answer(executive, 0.0)
    assert executive.simulation.plant.tick == RECORDER_LAG + 1
    for now in np.arange(0.0, 2.2, 0.1):
        executive.check(float(now))
    assert complete.said[-1] == "waiting for /recorder, which lags behind"
    assert executive.simulation.misses == 0
    assert not complete.events(EventKind.WARNING)
    for now in (STALLED, STALLED + 1.0, STALLED + 2.0):
        executive.check(now)
    (warning,) = complete.events(EventKind.WARNING)
    assert warning.detail == "/recorder records nothing after 0 s, and the run waits for it"
    assert complete.reports[-1].troubles == (warning.detail,)
    executive.recorded(RECORDER_LAG * 10**9, STALLED + 3.0)
    assert executive.simulation.plant.tick == RECORDER_LAG + 2
    assert complete.events(EventKind.WARNING)[-1].detail == "/recorder records again"
    executive.check(STALLED + 4.0)
    assert complete.reports[-1].troubles == ()


def test_a_recorder_that_has_just_come_is_given_its_time(complete: Graph) -> None:
    executive = start(complete, ticks=3 * RECORDER_LAG, on_recorder_loss="continue")
    for _ in range(2 * RECORDER_LAG):
        answer(executive, 0.0)
    complete.recorder = True
    for now in np.arange(100.0, 100.0 + STALLED, 0.1):
        executive.check(float(now))
    assert complete.said[-1] == "waiting for /recorder, which lags behind"
    assert not complete.events(EventKind.WARNING)
    executive.check(100.2 + STALLED)
    assert len(complete.events(EventKind.WARNING)) == 1


@pytest.mark.parametrize("choice", ["continue", "end"])
def test_a_recorder_that_dies_does_not_hold_the_plant(complete: Graph, choice: str) -> None:
    complete.recorder = True
    executive = start(complete, ticks=2 * RECORDER_LAG, on_recorder_loss=choice)
    executive.recorded(0, 0.0)
    executive.check(0.0)
    for _ in range(2 * RECORDER_LAG):
        answer(executive, 0.0)
    assert executive.simulation.plant.tick == RECORDER_LAG + 1, "it waits while it lives"
    complete.recorder = False
    if choice == "end":
        with pytest.raises(RecorderLostError, match=r"the recorder is gone: the run ends"):
            executive.check(0.1)
    else:
        executive.check(0.1)
        answer(executive, 0.1)
        assert executive.simulation.plant.tick > RECORDER_LAG + 1
        complete.recorder = True
        executive.check(0.2)
        assert complete.events(EventKind.WARNING)[-1].detail == "recorded again"
    assert "the recorder is gone" in complete.events(EventKind.WARNING)[0].detail
    executive._report("", 1.0)
    assert any("the recorder is gone" in text for text in complete.reports[-1].troubles)


def test_the_plant_stays_until_the_recorder_has_its_end(complete: Graph) -> None:
    executive = start(complete)
    for _ in range(TICKS):
        answer(executive, 0.0)
    assert executive.recorder_is_done(0.0), "without a recorder nobody waits"
    complete.recorder = True
    assert not executive.recorder_is_done(0.0)
    executive.recorded((TICKS - 1) * 10**9, 0.0)
    assert not executive.recorder_is_done(STALLED), "the last tick, but not the end"
    assert not complete.events(EventKind.WARNING)
    assert not executive.recorder_is_done(STALLED + 0.1)
    (warning,) = complete.events(EventKind.WARNING)
    assert warning.detail == f"/recorder records nothing after {TICKS - 1} s, and the run waits for it"
    executive.recorded(TICKS * 10**9, 0.0)
    assert executive.recorder_is_done(0.0)


def test_the_pace_decides_when_the_next_check_is(complete: Graph) -> None:
    executive = start(complete, real_time_factor=100.0)
    answer(executive, 0.001)
    assert executive.simulation.plant.tick == 0, "a tick of 1 s takes 10 ms"
    assert executive.period(0.001) == pytest.approx(0.009)
    executive.check(0.0101)
    assert executive.simulation.plant.tick == 1


@pytest.mark.parametrize("topic", ["/clock", "/truth", "/deputy1/measurement", *sorted(EVERYBODY)])
@pytest.mark.parametrize("other", ["/rosbag2_player", ""], ids=["another", "of the same name"])
def test_the_run_does_not_start_while_another_publishes_its_topics(complete: Graph, topic: str, other: str) -> None:
    (own,) = complete.publishers_of(topic)
    complete.others = {topic: [other or own]}
    executive = start(complete)
    names = f"{own} and {other}" if other else f"{own} (2 times)"
    assert complete.said == [f"waiting for only one publisher of {topic}: {names} are in this ROS domain"]
    assert not complete.messages
    complete.others = {}
    executive.check(0.1)
    assert complete.said[-1] == "flying"


@pytest.mark.parametrize(
    "topic", ["/clock", "/truth", "/deputy1/measurement", "/recorder/progress", *sorted(EVERYBODY)]
)
def test_another_publisher_in_flight_is_named_once_and_withstood(complete: Graph, topic: str) -> None:
    executive = start(complete, ticks=3)
    complete.others = {topic: ["/other"]}
    for now in (1.0, 2.0):
        executive.check(now)
        answer(executive, now)
    (event,) = complete.events(EventKind.WARNING)
    assert topic in event.detail
    assert "and /other" in event.detail or "/other and" in event.detail
    assert complete.reports[-1].troubles == (event.detail,)
    answer(executive, 3.0)
    assert executive.finished


def test_two_controllers_of_a_deputy_are_named(complete: Graph) -> None:
    executive = start(complete)
    complete.others = {COMMAND.of("deputy1"): ["/deputy1/mine"]}
    executive.check(1.0)
    (event,) = complete.events(EventKind.WARNING)
    assert event.detail == "/deputy1/thrust has several publishers: /deputy1/mine and /deputy1/module"


def test_two_of_one_name_are_told_from_one_that_was_started_again(complete: Graph) -> None:
    executive = start(complete)
    complete.others = {"/deputy1/estimate": ["/deputy1/module"]}
    executive.check(1.0)
    complete.others = {}
    executive.check(20.0)
    assert not complete.events(EventKind.WARNING), "the killed one is forgotten"
    complete.others = {"/deputy1/estimate": ["/deputy1/module"]}
    for now in range(21, 60):
        executive.check(float(now))
    (event,) = complete.events(EventKind.WARNING)
    assert event.detail == "/deputy1/estimate has several publishers: /deputy1/module (2 times)"


def test_two_controllers_of_one_name_contradict_each_other(complete: Graph) -> None:
    executive = start(complete)
    complete.others = {COMMAND.of("deputy1"): ["/deputy1/module"]}
    for tick in range(4):
        executive.check(float(tick))
        assert not complete.events(EventKind.WARNING), "a node that was killed is there a while longer"
        answer(executive, float(tick), 0.0)
        executive.answer("deputy1", Thrust(tick * 10**9, np.full(3, 1e-3)), float(tick))
        executive.answer("deputy1", Thrust(tick * 10**9, np.zeros(3)), float(tick))  # the same is no contradiction
        if tick == 2:
            break
    executive.check(9.0)
    assert len(complete.events(EventKind.WARNING)) == 1
