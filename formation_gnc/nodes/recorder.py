"""The recorder node: every topic, byte for byte, into an MCAP bag."""

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import Any

from rcl_interfaces.msg import ParameterType
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSDurabilityPolicy
from rclpy.task import Future
from rosgraph_msgs.msg import Clock

from formation_gnc.interface import NANOSECONDS
from formation_gnc.mission import Mission
from formation_gnc.nodes import topics
from formation_gnc.nodes.shell import ConfiguredNode, run
from formation_gnc.parameters import parameter
from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.writer import FLUSH_INTERVAL, BagWriter

LOOK_PERIOD = 0.1
"""Wall time (s) between looks for new topics and nodes, and between reports of progress."""

REPORT_TICKS = 64
"""Ticks after which progress is reported at the latest."""

QUIET = 0.2
"""Wall time (s) without a message after which a recorder that is told to stop believes that all has come."""


@dataclass(frozen=True)
class RecorderParameters(Mission):
    """Where to record to."""

    bag: str = parameter("", doc="directory to make for the bag; empty for bags/ and the date and time")


class RecorderNode(ConfiguredNode):
    """Subscribes to every topic there is and writes what comes, as it came.

    Messages are stamped with simulated time: their own header's for the project's messages, the latest
    tick's for others.
    """

    def __init__(self) -> None:
        """Make the bag; raises ConfigurationError if its directory exists."""
        super().__init__("recorder", RecorderParameters)
        directory = self.values.bag or f"bags/{datetime.now(UTC):%Y-%m-%d_%H-%M-%S}"
        self.bag = BagWriter(Path(directory), provenance())
        self.get_logger().info(f"recording to {directory}")
        self._progress = self.create_publisher(Clock, topics.RECORDED, topics.quality(topics.LATEST))
        self._topics: set[str] = set()
        self._counts: dict[str, int] = {}
        self._askable: dict[str, AsyncParameterClient] = {}
        self._settings: dict[str, dict[str, Any]] = {}
        self._time = 0
        self._heard: dict[str, int] = {}
        self._reported: int | None = None
        self._last_message = monotonic()
        self.create_timer(LOOK_PERIOD, self._look)
        self.create_timer(FLUSH_INTERVAL, self.bag.flush)

    def is_quiet(self) -> bool:
        """Whether nothing has come for a while."""
        return monotonic() - self._last_message > QUIET

    def close(self) -> None:
        """Finish the bag."""
        self.bag.close()

    def _look(self) -> None:
        for topic, (type_name, *_) in self.get_topic_names_and_types():
            if topic not in self._topics:
                self._topics.add(topic)
                self._record(topic, type_name)
        for service, _ in self.get_service_names_and_types():
            node, _, kind = service.rpartition("/")
            if kind == "get_parameters" and node not in self._askable:
                self._askable[node] = AsyncParameterClient(self, node)
        for node, client in self._askable.items():
            if node not in self._settings and client.services_are_ready():
                self._settings[node] = {}
                self._ask_parameters(node, client)
        if self._knows_the_run():
            self._report()

    def _knows_the_run(self) -> bool:
        """Whether the parameters of the plant and of every deputy's nodes are on record."""
        deputies = self._settings.get("/plant", {}).get("deputies", ())
        nodes = [f"/{deputy}/{part}" for deputy in deputies for part in topics.PARTS]
        return bool(nodes) and all(self._settings.get(node) for node in nodes)

    def _record(self, topic: str, type_name: str) -> None:
        try:
            package, kind, name = type_name.split("/")
            message_type = getattr(import_module(f"{package}.{kind}"), name)
            self.bag.add_topic(topic, type_name, topics.DEPTH)
        except (ImportError, AttributeError, ValueError) as error:
            self.get_logger().warning(f"{topic} is not recorded: {type_name} is not installed ({error})")
            return
        self._counts[topic] = 0
        offers = self.get_publishers_info_by_topic(topic)
        quality = topics.quality()
        if any(offer.qos_profile.durability == QoSDurabilityPolicy.VOLATILE for offer in offers):
            quality.durability = QoSDurabilityPolicy.VOLATILE
        self.create_subscription(message_type, topic, self._receiver(topic, message_type), quality, raw=True)

    def _receiver(self, topic: str, message_type: Any) -> Callable[[bytes], None]:
        stamped = "std_msgs/Header" in list(message_type.get_fields_and_field_types().values())[:1]
        is_clock = topic == topics.CLOCK
        paced = is_clock or topic == topics.TRUTH or topic.endswith(f"/{topics.MEASUREMENT}")

        def receive(data: bytes) -> None:
            self._last_message = monotonic()
            stamp = _first_stamp(data) if stamped or is_clock else self._time
            self._counts[topic] += 1
            self.bag.write(topic, data, stamp, self._counts[topic])
            if paced:
                self._heard[topic] = stamp
            if is_clock:
                self._time = stamp
                if self._counts[topic] % REPORT_TICKS == 0:
                    self._report()

        return receive

    def _report(self) -> None:
        """Tell the plant up to which tick all that it publishes at every tick is recorded."""
        recorded = min(self._heard.values(), default=-1)
        if recorded != self._reported:
            self._reported = recorded
            progress = Clock()
            progress.clock.sec, progress.clock.nanosec = divmod(recorded, NANOSECONDS)
            self._progress.publish(progress)

    def _ask_parameters(self, node: str, client: AsyncParameterClient) -> None:
        """Ask a node for all its parameters, for the record."""

        def on_list(answer: Future) -> None:
            names = list(answer.result().result.names)
            client.get_parameters(names, callback=lambda values: on_values(names, values))

        def on_values(names: list[str], answer: Future) -> None:
            self._settings[node] = {
                name: parameter_value_to_python(value)
                for name, value in zip(names, answer.result().values, strict=True)
                if value.type != ParameterType.PARAMETER_NOT_SET
            }
            # at once, so that a bag that is cut short can be flown again
            recorded = {name: json.dumps(value) for name, value in self._settings[node].items()}
            self.bag.add_metadata(f"parameters {node}", recorded)

        client.list_parameters(callback=on_list)


def _first_stamp(data: bytes) -> int:
    """The stamp that a message begins with, in ns: after four bytes that tell how it is encoded."""
    seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
    return int(seconds * NANOSECONDS + nanoseconds)


def record(node: RecorderNode) -> None:
    """Record until told to stop, and then until nothing more comes."""
    try:
        node.spin()
        node.spin(node.is_quiet)
    finally:
        node.close()


def main() -> int:
    """Run the node."""
    return run(RecorderNode, record)
