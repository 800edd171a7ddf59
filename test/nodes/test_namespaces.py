"""Formations in namespaces of one ROS domain fly beside one another, each recorded by its own names."""

import time

import pytest

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.recording import Bag
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.plant_node import PlantNode
from formation_gnc.transport.recorder_node import RecorderNode

from .conftest import Bench

pytestmark = pytest.mark.sil

TICKS = 5


def formation(bench: Bench, namespace: str, *options: str) -> list[ConfiguredNode]:
    """All nodes of a run, the plant first."""
    remap = ["-r", f"__ns:={namespace or '/'}"]
    of_deputy = ["-r", f"__ns:={namespace}/deputy1"]
    run = ["-p", f"duration:={TICKS}.0", "-p", "deadline:=600.0", "-p", "wait_for_recorder:=true"]
    nodes = [bench.make("plant", *remap, *run), bench.make("recorder", *remap, *options)]
    return [*nodes, *(bench.make(name, *of_deputy) for name in MODULES)]


def fly(bench: Bench, nodes: list[ConfiguredNode]) -> None:
    plants = [node for node in nodes if isinstance(node, PlantNode)]

    def is_over() -> bool:
        for plant in plants:
            plant.executive.check(0.0)
        return all(plant.executive.finished and plant.executive.recorder_is_done(time.monotonic()) for plant in plants)

    bench.spin(*nodes, until=is_over)


def recorded(nodes: list[ConfiguredNode]) -> list[Bag]:
    sessions = [node.session for node in nodes if isinstance(node, RecorderNode)]
    for session in sessions:
        session.close()
    return [Bag(session.bag.directory) for session in sessions]


# One process has them all, whose participant outlives a test: each formation has a name of its own.
@pytest.mark.parametrize("namespaces", [["/alpha"], ["/beta", "/gamma"], ["/x/delta", "/x/y/delta"]])
def test_each_formation_is_recorded_by_its_names_and_alone(bench: Bench, namespaces: list[str]) -> None:
    nodes = [node for namespace in namespaces for node in formation(bench, namespace)]
    fly(bench, nodes)
    for bag in recorded(nodes):
        for topic in (topics.CLOCK.name, topics.TRUTH.name, "/deputy1/measurement", "/deputy1/thrust"):
            assert bag.topics[topic].count == TICKS, topic
        assert not [topic for topic in bag.topics if topic.startswith(tuple(namespaces))]
        assert "parameters /deputy1/controller" in bag.metadata


def test_a_recorder_of_another_name_and_a_controller_of_another_name_count(bench: Bench) -> None:
    run = ["-p", f"duration:={TICKS}.0", "-p", "deadline:=600.0", "-p", "wait_for_recorder:=true"]
    there, of_deputy = ["-r", "__ns:=/omega"], ["-r", "__ns:=/omega/deputy1"]
    nodes = [bench.make("plant", *there, *run), bench.make("recorder", *there, "-r", "__node:=tape")]
    nodes += [bench.make("controller", *of_deputy, "-r", "__node:=autopilot")]
    nodes += [bench.make(name, *of_deputy) for name in ("guidance", "navigation", "supervisor")]
    fly(bench, nodes)
    (bag,) = recorded(nodes)
    assert bag.topics["/deputy1/thrust"].count == TICKS
    assert bag.metadata["parameters /deputy1/controller"]["algorithm"] == '"lqr"'
