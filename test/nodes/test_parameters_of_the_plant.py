"""Nodes take from their parameter file what it gives the plant, and say where they are told otherwise."""

from pathlib import Path

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from formation_gnc.transport.node import ConfiguredNode

from .conftest import Bench

pytestmark = pytest.mark.sil

FILE = """
/plant:
  ros__parameters:
    duration: 10.0
    tick: 2.0
    chief: {semi_major_axis: 7.0e+6, inclination: 1.0}
    deputies: [chaser]
    chaser:
      relative_state: [0.0, -100.0, 0.0, 0.0, 0.0, 0.0]
      mass: 50.0
      thrusters: {limit: [0.1, 0.2, 0.3]}
      sensors: {radius: {sigma: 7.0}, chief_range: {"on": true}}
/chaser/guidance: {ros__parameters: {thrust_limit: [1.0, 1.0, 1.0]}}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "chase.yaml"
    path.write_text(FILE)
    return path


@pytest.fixture
def warnings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What nodes warn of."""
    said: list[str] = []

    class Logger:
        def __getattr__(self, level: str) -> object:
            return said.append if level == "warning" else lambda _: None

    monkeypatch.setattr(ConfiguredNode, "get_logger", lambda _: Logger())
    return said


@pytest.mark.parametrize("namespace", ["", "/alpha"])
def test_a_node_follows_the_plant_of_its_parameter_file(
    namespace: str, bench: Bench, file: Path, warnings: list[str]
) -> None:
    place = ("-r", f"__ns:={namespace}/chaser")
    navigation, controller = (bench.make(name, *place, files=(file,)).values for name in ("navigation", "controller"))
    assert (navigation.radius_sigma, navigation.tick, navigation.chief.inclination) == (7.0, 2.0, 1.0)
    assert navigation.sensors == ("radius", "range_rate", "latitude", "chief_range")
    assert (controller.mass, controller.thrust_limit) == (50.0, (0.1, 0.2, 0.3))
    assert warnings == []


def test_a_node_says_where_it_differs_from_the_plant(bench: Bench, file: Path, warnings: list[str]) -> None:
    place = ("-r", "__ns:=/chaser")
    bench.make("guidance", *place, files=(file,))
    bench.make("controller", *place, "-p", "mass:=40.0", files=(file,))
    assert warnings == [
        "thrust_limit is [1.0, 1.0, 1.0] N, the plant's chaser.thrusters.limit [0.1, 0.2, 0.3] N",
        "mass is 40.0 kg, the plant's chaser.mass 50.0 kg",
    ]


def test_recorder_and_display_share_the_plants_tick(bench: Bench, file: Path) -> None:
    assert [bench.make(name, files=(file,)).values.tick for name in ("recorder", "display", "plant")] == [2.0] * 3


def test_faults_are_set_in_flight_from_the_next_tick_on(bench: Bench) -> None:
    plant = bench.make("plant")
    fault = "{at: 0.0, deputy: deputy1, fault: bias, sensor: radius, value: 20.0}"

    def put(*faults: str) -> tuple[bool, str]:
        request = SetParameters.Request(parameters=[Parameter("faults", value=list(faults)).to_parameter_msg()])
        (result,) = bench.call(plant, SetParameters, "set_parameters", request).results
        return result.successful, result.reason

    accepted, reason = put(fault.replace("radius", "radios"))
    assert (accepted, reason.partition("}': ")[2]) == (False, "sensor: 'radios' is unknown; did you mean radius?")
    assert plant.get_parameter("faults").value == []
    assert put(fault) == (True, "")
    assert plant.get_parameter("faults").value == [fault]
    flown = plant.executive.simulation.plant
    flown.measure()
    assert [str(event) for event in flown.take_events()] == [
        f'tick 0: parameters: faults: [] -> ["{fault}"]',
        "tick 0: fault: deputy1: begins: radius biased by 20 m",
    ]
    assert put() == (True, "")
    assert plant.get_parameter("faults").value == []
