"""A flight module is its class, a row of the graph table and the name of its executable."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES, Input, Row, add_module
from formation_gnc.flight.module import FlightModule, ModuleParameters
from formation_gnc.flight.topics import Topic
from formation_gnc.parameters import parameter, to_json
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.layout import foxglove_layout
from formation_gnc.recording.progress import RecordingProgress
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Clock, Status, Thrust
from formation_gnc.sil.replay_recorder import replay_into
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

TICKS = 20
NODE = "/deputy1/burn_clock"


# --- formation_gnc/burns/burn_clock.py, as a new module would be written


@dataclass(frozen=True)
class BurnClockParameters(ModuleParameters):
    """When a thruster counts as firing."""

    threshold: float = parameter(0.0, unit="N", minimum=0.0, in_flight=True, doc="force above which it counts")


class BurnClock(FlightModule[BurnClockParameters, float]):
    """Time in which thrusters were commanded so far."""

    def reset(self) -> None:
        """No burn yet."""
        self.burnt = 0

    def design(self, parameters: BurnClockParameters) -> float:
        """Nothing to design."""
        return parameters.threshold

    def on_tick(self, thrust: Thrust, status: Status) -> Clock:
        """The time so far; `status` is taken for show."""
        self.begin_tick(thrust.time)
        self.burnt += self.parameters.tick_ns * bool(abs(thrust.force).max() > self.configuration.design)
        return Clock(self.burnt)


# --- the line in formation_gnc/flight/topics.py and the row in formation_gnc/flight/graph.py

BURN_TIME = Topic("burn_time", Clock, "every tick", "time in which thrusters were commanded")
ROW = Row(
    "burn_clock",
    f"{__name__}:BurnClock",
    f"{__name__}:BurnClockParameters",
    takes=(Input.whole(topics.THRUST), Input.whole(topics.STATUS)),
    gives=(BURN_TIME,),
)


@pytest.fixture(autouse=True)
def graph_with_a_burn_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MODULES, ROW.name, ROW)


def fly(**values: Any) -> tuple[Run, dict[str, list[Any]]]:
    """A short in-process flight, with the new module's parameters in the scenario."""
    sections = {"/plant": {"duration": float(TICKS)}, "/**/burn_clock": values}
    run, records = Run(load_scenario("leader_follower", sections)), dict[str, list[Any]]()
    run.fly(lambda topic, record: records.setdefault(topic, []).append(record))
    return run, records


def test_it_flies_with_parameters_from_the_scenario() -> None:
    _, records = fly()
    assert [record.clock for record in records["/deputy1/burn_time"]] == [(k + 1) * 10**9 for k in range(TICKS)]
    _, records = fly(threshold=1.0)
    assert {record.clock for record in records["/deputy1/burn_time"]} == {0}
    with pytest.raises(ConfigurationError, match="burn_clock: parameter threshold: -1"):
        fly(threshold=-1.0)


def test_a_schedule_changes_it_in_flight() -> None:
    _, records = fly(schedule=["{at: 5.0, threshold: 1.0}"])
    assert records["/deputy1/burn_time"][-1].clock == 5 * 10**9
    (change,) = [event for event in records["/events"] if event.node == NODE]
    assert [(each.name, each.new_value) for each in change.changes] == [("threshold", "1.0")]


def test_the_recorder_awaits_it_and_the_layout_shows_it() -> None:
    assert RecordingProgress().concerns("/deputy1/burn_time")
    assert 'node==\\"burn_clock\\"' in foxglove_layout(["deputy1"])


def test_a_bag_with_it_is_replayed_to_the_same_bits(tmp_path: Path) -> None:
    scenario = load_scenario("leader_follower", {"/plant": {"duration": float(TICKS)}})
    parameters = {
        f"parameters {node}": {name: to_json(value) for name, value in values.items()}
        for node, values in scenario.parameters().items()
    }
    assert f"parameters {NODE}" in parameters
    with BagWriter(tmp_path / "bag", parameters) as writer:
        Run(scenario).fly(InProcessRecorder(writer))
    assert replay_into(Bag(tmp_path / "bag"), tmp_path / "again", list(MODULES), None) == []
    first, second = (Bag(tmp_path / name).arrays("/deputy1/burn_time") for name in ("bag", "again"))
    assert first["clock.sec"].tolist() == second["clock.sec"].tolist() == list(range(1, TICKS + 1))


def test_a_name_that_is_taken_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="module burn_clock: is in the graph table already"):
        add_module(ROW)
