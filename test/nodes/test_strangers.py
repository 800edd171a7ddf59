"""What other nodes publish on topics of a flight is withstood: the flight and its bag are those of the flight alone."""

import time

import pytest
import rclpy
from rclpy.node import Node

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.recording import Bag, identical
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.message_types import message_class
from formation_gnc.transport.plant_node import PlantNode
from formation_gnc.transport.qos import quality
from formation_gnc.transport.recorder_node import RecorderNode

from .conftest import Bench

pytestmark = pytest.mark.sil

TICKS = 10
JOIN = 4
"""Tick at which the stranger begins."""


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> list[Bag]:
    """The flight in this process, and the same with another seed."""
    bags = []
    for seed in (1, 2):
        path = tmp_path_factory.mktemp("flights") / f"seed{seed}"
        with BagWriter(path, provenance(), {}) as bag:
            overrides = {"/plant": {"duration": float(TICKS), "seed": seed}}
            Run(load_scenario("leader_follower", overrides)).fly(InProcessRecorder(bag))
        bags.append(Bag(path))
    return bags


def publish_all(stranger: Node, bag: Bag, names: list[str]) -> None:
    """Play a bag at once, as `ros2 bag play` does."""
    publishers = {
        name: stranger.create_publisher(message_class(bag.topics[name].type_name), name, quality()) for name in names
    }
    for name, data, _ in bag.messages(names):
        publishers[name].publish(data)


# A topic each of the plant, of the clock, and of every module.
@pytest.mark.parametrize(
    "names",
    [["/clock", "/truth"], ["/deputy1/measurement"], *(["/deputy1/" + row.answer.name] for row in MODULES.values())],
    ids=lambda names: names[0],
)
def test_a_bag_played_into_a_flight_changes_nothing_and_is_named(
    bench: Bench, flights: list[Bag], names: list[str]
) -> None:
    """The bag is of the same flight with another seed: its stamps are those of this one."""
    alone, other = flights
    run = ["-p", "seed:=1", "-p", f"duration:={TICKS}.0", "-p", "deadline:=600.0", "-p", "wait_for_recorder:=true"]
    plant = bench.make("plant", *run)
    recorder = bench.make("recorder")
    nodes = [plant, recorder, *(bench.make(name, "-r", "__ns:=/deputy1") for name in MODULES)]
    assert isinstance(plant, PlantNode)
    assert isinstance(recorder, RecorderNode)
    executive, stranger = plant.executive, rclpy.create_node("stranger", start_parameter_services=False)
    try:
        now, joined = 0.0, False

        def is_over() -> bool:
            nonlocal now, joined
            now += 1.0
            executive.check(now)
            if not joined and executive.simulation.plant.tick >= JOIN:
                publish_all(stranger, other, names)
                bench.spin(until=lambda: plant.count_publishers(names[0]) > 1)
                joined = True
                executive.check(now)
            return executive.finished and executive.recorder_is_done(time.monotonic())

        bench.spin(*nodes, until=is_over)
    finally:
        stranger.destroy_node()
    recorder.session.close()
    bag = Bag(recorder.session.bag.directory)
    troubles = "; ".join(executive._troubles)
    assert "/stranger" in troubles
    assert all(name in troubles for name in names)
    assert bag.are_told_apart
    flown = [topic for topic in alone.topics if topic not in (topics.EVENTS.name, topics.TIMING.of("deputy1"))]
    assert identical(alone, bag, flown) == []
