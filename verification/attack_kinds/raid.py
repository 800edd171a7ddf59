"""A stranger in the domain of a flight: what it may reach, and how."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.context import Context
from rclpy.node import Node

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.reader import Bag
from formation_gnc.transport.message_types import message_class
from formation_gnc.transport.parameter_client import set_parameters
from formation_gnc.transport.processes import executable
from formation_gnc.transport.qos import quality

MATCHED = 5.0
"""Wall time (s) in which a publisher finds its readers."""


@dataclass
class Raid:
    """A stranger, and the flight that it is in."""

    node: Node
    domain: int
    bag: Path
    other: Bag
    """A flight of the same scenario with another seed: its stamps are those of this one."""
    chance: Random

    def send(self, topic: str, messages: Iterable[bytes], kind: str = "", profile: Any = None) -> None:
        """Publish bytes on a topic once a reader is there; by default of the topic's type, and kept for who is late."""
        type_name = kind or self.other.topics[topic].type_name
        publisher = self.node.create_publisher(message_class(type_name), topic, profile or quality())
        end = time.monotonic() + MATCHED
        while not publisher.get_subscription_count() and time.monotonic() < end and not kind:
            time.sleep(0.02)
        for data in messages:
            try:
                publisher.publish(data)
            except RCLError:  # more bytes than a type of fixed length has are not sent
                continue

    def recorded(self, topic: str) -> list[bytes]:
        """Messages of the other flight."""
        return [data for _, data, _ in self.other.messages([topic])]

    def set(self, node: str, **values: Any) -> str:
        """Change parameters; returns the reason of a rejection, empty for none."""
        try:
            set_parameters(node, values, self.domain, 5.0)
        except ConfigurationError as error:
            return str(error)
        return ""

    def pid(self, node: str) -> int:
        """Process number of a node of the flight."""
        namespace, _, kind = node.rpartition("/")
        for entry in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = entry.read_bytes().decode(errors="replace").split("\0")
            except OSError:
                continue
            is_it = any(word.endswith(f"/lib/formation_gnc/{kind}") for word in words)
            if is_it and (not namespace or f"__ns:={namespace}" in words) and self._is_of_flight(entry):
                return int(entry.parent.name)
        raise LookupError(node)

    def _is_of_flight(self, entry: Path) -> bool:
        parent = (entry.parent / "stat").read_text().rpartition(")")[2].split()[1]
        return int(parent) == os.getpid()

    def signal(self, node: str, number: signal.Signals) -> None:
        """Send a signal to a node of the flight."""
        os.kill(self.pid(node), number)

    @contextmanager
    def started(self, kind: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
        """A node of ours in the same domain; it is ended afterwards."""
        environment = os.environ | {"ROS_DOMAIN_ID": str(self.domain)}
        process = subprocess.Popen(
            [executable(kind), "--ros-args", *arguments],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            yield process
        finally:
            process.kill()
            process.wait()


Attack = Callable[[Raid], object]


@contextmanager
def raiding(domain: int, bag: Path, other: Bag) -> Iterator[Raid]:
    """A stranger in a domain."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = rclpy.create_node("stranger", context=context, start_parameter_services=False)
    try:
        yield Raid(node, domain, bag, other, Random(18))
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)
