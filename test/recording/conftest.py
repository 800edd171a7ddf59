"""Messages of a flight, serialized by ROS."""

from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from formation_gnc_msgs.msg import Estimate, Event, Innovation, Measurement, Reading, SatelliteTruth, Thrust, Truth
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.recording.writer import BagWriter

TICKS = 120


class Recorded(NamedTuple):
    topic: str
    type_name: str
    message: Any
    data: bytes
    stamp_ns: int


def record(topic: str, message: Any, stamp_ns: int) -> Recorded:
    package, _, _ = type(message).__module__.partition(".")
    type_name = f"{package}/msg/{type(message).__name__}"
    data = message_type(type_name).canonical(serialize_message(message))  # as it comes over DDS
    return Recorded(topic, type_name, message, data, stamp_ns)


@cache
def message_type(type_name: str) -> MessageType:
    return installed_type(type_name)


def flight_messages(ticks: int, first: int = 0) -> list[Recorded]:
    """Messages of a flight: fixed and varying lengths, nested messages, an event now and then."""
    rng = np.random.default_rng(1)
    messages = []
    for tick in range(first, first + ticks):
        stamp_ns = tick * 10**9 + 5 * 10**8
        stamp = Time(sec=tick, nanosec=5 * 10**8)
        sensors = ["radius", "latitude"][: 1 + tick // 40] if tick % 10 == 0 else []
        deputies = [
            SatelliteTruth(name=name, inertial_state=rng.normal(size=6), mass=100.0 - tick, eclipse=tick % 3 == 0)
            for name in ("deputy1", "the second deputy")
        ]
        header = Header(stamp=stamp, frame_id="hill")
        messages += [
            record("/clock", Clock(clock=stamp), stamp_ns),
            record(
                "/truth",
                Truth(header=Header(stamp=stamp), chief_state=rng.normal(size=6), deputies=deputies),
                stamp_ns,
            ),
            record(
                "/deputy1/measurement",
                Measurement(
                    header=header, readings=[Reading(sensor=each, values=[rng.normal()]) for each in sensors], mass=99.5
                ),
                stamp_ns,
            ),
            record(
                "/deputy1/estimate",
                Estimate(
                    header=header,
                    relative_state=rng.normal(size=6),
                    covariance=rng.normal(size=36),
                    innovations=[Innovation(sensor=each, values=rng.normal(size=tick // 40)) for each in sensors],
                    nis=float(tick),
                    status=tick % 2,
                ),
                stamp_ns,
            ),
            record("/deputy1/thrust", Thrust(header=header, force=rng.normal(size=3)), stamp_ns),
        ]
        if tick % 25 == 3:
            event = Event(header=header, tick=tick, node="/plant", kind=Event.MISS, detail="zu spät " * (tick % 4))
            messages.append(record("/events", event, stamp_ns))
    return messages


@pytest.fixture(scope="session")
def flight() -> list[Recorded]:
    return flight_messages(TICKS)


Write = Callable[..., Path]


@pytest.fixture(scope="session")
def write_bag() -> Write:
    """Write messages to a bag; options are those of the writer."""

    def write(directory: Path, messages: Iterable[Recorded], close: bool = True, **options: Any) -> Path:
        writer = BagWriter(directory, options.pop("provenance", {"run": {"seed": "1"}}), **options)
        messages = list(messages)
        for topic, type_name in dict.fromkeys((message.topic, message.type_name) for message in messages):
            writer.add_topic(topic, type_name, depth=10)
        for sequence, message in enumerate(messages):
            writer.write(message.topic, message.data, message.stamp_ns, sequence)
        if close:
            writer.close()
        else:
            writer.flush()
        return directory

    return write


@pytest.fixture(scope="session")
def bag_path(tmp_path_factory: pytest.TempPathFactory, flight: list[Recorded], write_bag: Write) -> Path:
    return write_bag(tmp_path_factory.mktemp("bags") / "flight", flight)
