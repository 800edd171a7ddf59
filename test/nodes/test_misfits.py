"""Bytes that do not fit their type, and forged messages, on every topic of a flight: it flies on, and says whose."""

import gc
import time
from contextlib import suppress
from typing import Any

import pytest
import rclpy
from rclpy._rclpy_pybind11 import RCLError

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.messages.conversion import from_cdr, to_cdr
from formation_gnc.recording import Bag
from formation_gnc.records import Clock, Event
from formation_gnc.transport.message_types import message_class
from formation_gnc.transport.plant_node import PlantNode
from formation_gnc.transport.qos import quality
from formation_gnc.transport.recorder_node import RecorderNode

from .conftest import Bench

pytestmark = pytest.mark.sil

TICKS = 12
JOIN = 4
"""Tick at which the stranger begins."""

SHORT = [b"\0\1\0\0", b"\0\1\0\0\1\0\0", b"\0\1\0\0" + b"\xff" * 60]
"""No message of any type: an encapsulation alone, cut in the stamp, with counts beyond the end."""


def test_no_bytes_on_any_topic_end_a_node_or_change_the_flight(bench: Bench) -> None:
    run = ["-p", f"duration:={TICKS}.0", "-p", "deadline:=600.0", "-p", "wait_for_recorder:=true"]
    plant, recorder, display = bench.make("plant", *run), bench.make("recorder"), bench.make("display")
    modules = [bench.make(name, "-r", "__ns:=/deputy1") for name in MODULES]
    assert isinstance(plant, PlantNode)
    assert isinstance(recorder, RecorderNode)
    executive, stranger = plant.executive, rclpy.create_node("stranger", start_parameter_services=False)
    names = [each.name for each in topics.RUN_TOPICS if each.record or each.name in ("/clock", "/recorder/progress")]
    names += [each.of("deputy1") for each in topics.DEPUTY_TOPICS if not each.fleet_only]
    publishers: dict[str, Any] = {}
    now = 0.0

    def is_over() -> bool:
        nonlocal now
        now += 1.0
        executive.check(now)
        if not publishers and executive.simulation.plant.tick >= JOIN:
            for name in names:
                publishers[name] = stranger.create_publisher(message_class(topics.types_of(name)[0]), name, quality())
            bench.spin(until=lambda: all(stranger.count_subscribers(name) for name in names))
        for publisher in publishers.values():
            for data in SHORT:
                with suppress(RCLError):  # more bytes than a type of fixed length has are not sent
                    publisher.publish(data)
        if publishers:  # well formed: back to the start, to 2038, an event without words
            for stamp in (0, (2**31 - 1) * 10**9):
                publishers[topics.CLOCK.name].publish(to_cdr(Clock(stamp)))
                publishers[topics.PROGRESS.name].publish(to_cdr(Clock(stamp)))
            publishers[topics.EVENTS.name].publish(to_cdr(Event(0, 0, "", 255)))
        return executive.finished and executive.recorder_is_done(time.monotonic())

    try:
        bench.spin(plant, recorder, display, *modules, until=is_over)
    finally:
        stranger.destroy_node()
        gc.collect()
    assert executive.simulation.misses == 0
    recorder.session.close()
    bag = Bag(recorder.session.bag.directory)
    assert bag.topics[topics.TRUTH.name].count == TICKS
    said = [from_cdr(Event, data).detail for _, data, _ in bag.messages([topics.EVENTS.name]) if len(data) > 80]
    assert any("/stranger" in text and "/plant is heard" in text for text in said)
