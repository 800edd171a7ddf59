"""The floor of the lock-step graph: four processes that pass the same messages on and do nothing else.

Same message types, sizes (but for some bytes), topics, quality of service and executor as in the graph; each
answers with a message made beforehand and only stamped. Run as ``python -m bench.floor KIND ROLE TICKS``, for
the kinds in `RELAYS`; the plant prints its ticks per second.
"""

import struct
import sys
from contextlib import suppress
from functools import partial
from time import perf_counter
from typing import Any

import formation_gnc_msgs.msg as messages
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.task import Future
from rosgraph_msgs.msg import Clock

from formation_gnc.flight import topics
from formation_gnc.transport.loop import Executor
from formation_gnc.transport.qos import LATEST, quality

STAMP = struct.Struct("<i")
"""Seconds of a stamp, with which every message begins."""

ROLES = ("navigation", "guidance", "controller", "plant")
INPUTS = {
    "navigation": [(messages.Measurement, topics.MEASUREMENT.name)],
    "guidance": [(messages.Estimate, topics.ESTIMATE.name)],
    "controller": [(messages.Estimate, topics.ESTIMATE.name), (messages.Target, topics.TARGET.name)],
    "plant": [(messages.Thrust, topics.THRUST.name)],
}
OUTPUTS = {
    "navigation": [(messages.Estimate, topics.ESTIMATE.name), (messages.Timing, topics.TIMING.name)],
    "guidance": [(messages.Target, topics.TARGET.name), (messages.Timing, topics.TIMING.name)],
    "controller": [
        (messages.Thrust, topics.THRUST.name),
        (messages.Status, topics.STATUS.name),
        (messages.Timing, topics.TIMING.name),
    ],
    "plant": [
        (messages.Measurement, topics.MEASUREMENT.name),
        (messages.Truth, topics.TRUTH.name),
        (Clock, topics.CLOCK.name),
    ],
}


class Relay(Node):  # type: ignore[misc]
    """Answers when all its inputs of one stamp have come, with messages as rclpy makes and reads them."""

    raw = False

    def __init__(self, role: str, ticks: int) -> None:
        """Connect as the graph's node of this role does."""
        super().__init__(role, namespace="deputy1")
        self.role, self.ticks, self.tick = role, ticks, 0
        self.done = Future()
        self.outputs = [
            (self.made(_filled(kind())), self.create_publisher(kind, topic, quality())) for kind, topic in OUTPUTS[role]
        ]
        self.stamps: dict[str, int] = {}
        for kind, topic in INPUTS[role]:
            hear = partial(self.receive, topic)
            self.create_subscription(kind, topic, hear, quality(LATEST), raw=self.raw)

    def made(self, message: Any) -> Any:
        """What is kept to be sent."""
        return message

    def stamp(self, received: Any) -> int:
        """Of what has come."""
        tick: int = received.header.stamp.sec
        return tick

    def stamped(self, made: Any, tick: int) -> Any:
        """What is kept, with the stamp of a tick."""
        stamp = made.clock if isinstance(made, Clock) else made.header.stamp
        stamp.sec = tick
        return made

    def receive(self, topic: str, received: Any) -> None:
        """Take an input, and answer when all are there."""
        tick = self.stamps[topic] = self.stamp(received)
        if len(self.stamps) < len(INPUTS[self.role]) or len(set(self.stamps.values())) > 1:
            return
        if self.role != "plant":
            self.answer(tick)
        elif tick == self.tick:
            self.tick += 1
            if self.tick == self.ticks:
                self.done.set_result(None)
            else:
                self.answer(self.tick)

    def answer(self, tick: int) -> None:
        """Publish every output with the stamp of a tick."""
        for made, publisher in self.outputs:
            publisher.publish(self.stamped(made, tick))

    def everyone_is_there(self) -> bool:
        """Whether the other roles have been discovered."""
        return {*ROLES} <= {name for name, _ in self.get_node_names_and_namespaces()}


class RawRelay(Relay):
    """The same with bytes, of which nobody looks at more than the stamp: what DDS and executor cost alone."""

    raw = True

    def made(self, message: Any) -> bytes:
        """Serialised once."""
        data: bytes = serialize_message(message)
        return data

    def stamp(self, received: bytes) -> int:
        """Read in its place."""
        tick: int = STAMP.unpack_from(received, 4)[0]
        return tick

    def stamped(self, made: bytes, tick: int) -> bytes:
        """Written in its place."""
        return made[:4] + STAMP.pack(tick) + made[8:]


RELAYS = {"messages": Relay, "bytes": RawRelay}


def _filled(message: Any) -> Any:
    if not isinstance(message, Clock):
        message.header.frame_id = "hill"
    if isinstance(message, messages.Truth):
        message.deputies = [messages.SatelliteTruth(name="deputy1")]
    return message


def main(kind: str, role: str, ticks: int) -> None:
    """Relay until told to stop; the plant until all ticks have passed."""
    rclpy.init()
    node = RELAYS[kind](role, ticks)
    executor = Executor()
    executor.add_node(node)
    if role == "plant":
        while not node.everyone_is_there():
            executor.spin_until_future_complete(node.done, timeout_sec=0.1)
        started = perf_counter()
        node.answer(0)
    while rclpy.ok() and not node.done.done():
        executor.spin_until_future_complete(node.done, timeout_sec=0.1)
    if role == "plant":
        print(ticks / (perf_counter() - started))
    rclpy.try_shutdown()


if __name__ == "__main__":
    with suppress(ExternalShutdownException):
        main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
