"""Nodes of other people: writers of any quality of service are heard, and nothing is lost at the start."""

from dataclasses import replace

import numpy as np
import pytest
from rclpy.publisher import Publisher
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy, qos_profile_sensor_data

from formation_gnc.flight import topics
from formation_gnc.messages.conversion import from_cdr, to_cdr
from formation_gnc.records import Estimate, Event, EventKind, Measurement, Thrust
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.message_types import message_type
from formation_gnc.transport.node import ConfiguredNode

from .conftest import Bench

pytestmark = pytest.mark.sil

PROFILES = {
    "default": QoSProfile(depth=10),
    "latched": QoSProfile(depth=10, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL),
    "best effort": QoSProfile(depth=10, reliability=QoSReliabilityPolicy.BEST_EFFORT),
    "sensor data": qos_profile_sensor_data,
}


@pytest.fixture(scope="module")
def measurements() -> list[Measurement]:
    """Of the first ticks of the default scenario; the first has a fix."""
    taken: list[Measurement] = []
    run = Run(load_scenario("leader_follower", {"/plant": {"duration": 10.0}}))
    run.fly(lambda _, record: taken.append(record) if isinstance(record, Measurement) else None)
    return taken


class Ears:
    """The estimates of a navigation node, and what it says of itself."""

    def __init__(self, bench: Bench, node: ConfiguredNode) -> None:
        self.bench, self.node = bench, node
        self.estimates: list[Estimate] = []
        bench.user.create_subscription(
            message_type(Estimate),
            topics.ESTIMATE.of("deputy1"),
            lambda data: self.estimates.append(from_cdr(Estimate, data)),
            QoSProfile(depth=500, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL),
            raw=True,
        )
        self.warnings: list[str] = []
        bench.user.create_subscription(message_type(Event), topics.EVENTS.name, self.take_event, 10, raw=True)

    def take_event(self, data: bytes) -> None:
        event = from_cdr(Event, data)
        if event.kind == EventKind.WARNING:
            self.warnings.append(event.detail)


def measurement_publisher(bench: Bench, node: ConfiguredNode, profile: QoSProfile) -> Publisher:
    """A publisher of measurements that somebody subscribes to."""
    publisher = bench.user.create_publisher(message_type(Measurement), topics.MEASUREMENT.of("deputy1"), profile)
    bench.spin(node, until=lambda: publisher.get_subscription_count() > 0)
    return publisher


def publish(bench: Bench, node: ConfiguredNode, profile: QoSProfile, records: list[Measurement]) -> None:
    """As `ros2 bag play` does: all at once as soon as somebody subscribes."""
    publisher = measurement_publisher(bench, node, profile)
    for record in records:
        publisher.publish(to_cdr(record))


@pytest.mark.parametrize("profile", PROFILES)
def test_navigation_hears_writers_of_any_quality_of_service(
    bench: Bench, measurements: list[Measurement], profile: str
) -> None:
    node = bench.make("navigation")
    ears = Ears(bench, node)
    publisher = measurement_publisher(bench, node, PROFILES[profile])
    for count, record in enumerate(
        measurements, start=1
    ):  # in lock-step: a late filter goes on with the last of several
        publisher.publish(to_cdr(record))
        bench.spin(node, until=lambda count=count: len(ears.estimates) == count)  # type: ignore[misc]
    assert [each.time for each in ears.estimates] == [each.time for each in measurements], "each once, the fix too"


def test_navigation_without_a_fix_says_what_it_waits_for(bench: Bench, measurements: list[Measurement]) -> None:
    node = bench.make("navigation")
    ears = Ears(bench, node)
    publish(bench, node, PROFILES["default"], measurements[1:5])
    bench.spin(node, until=lambda: bool(ears.warnings))
    assert ears.warnings == ["no estimate before a measurement has an acquisition fix"], "once"
    assert node._module.waiting_for == "an acquisition fix"
    with_fix = replace(measurements[5], fix_available=True, fix=measurements[0].fix)
    publish(bench, node, PROFILES["default"], [with_fix])
    bench.spin(node, until=lambda: bool(ears.estimates))
    assert node._module.waiting_for == ""


@pytest.mark.parametrize("profile", PROFILES)
def test_the_plant_hears_commands_of_any_quality_of_service(bench: Bench, profile: str) -> None:
    node = bench.make("plant", "-p", "deadline:=600.0")
    for row in ("estimate", "target", "mode"):
        record = next(each.record for each in topics.DEPUTY_TOPICS if each.name == row)
        bench.user.create_publisher(message_type(record), f"/deputy1/{row}", 10)
    publisher = bench.user.create_publisher(message_type(Thrust), topics.THRUST.of("deputy1"), PROFILES[profile])
    executive = node.executive

    def stamp() -> int:
        executive.check(0.0)
        return executive.simulation.barrier.stamp

    for tick in range(3):
        bench.spin(node, until=lambda tick=tick: stamp() == tick * 10**9)  # type: ignore[misc]
        publisher.publish(to_cdr(Thrust(tick * 10**9, np.full(3, 1e-3))))
    bench.spin(node, until=lambda: executive.simulation.plant.tick == 3)
    assert executive.simulation.misses == 0
