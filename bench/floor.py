"""The floor of the lock-step graph: four processes that pass the same messages on and do nothing else.

Same message types and sizes, same topics, quality of service and executor as the graph; each answers with a
message made beforehand and only stamped. Run as ``python -m bench.floor ROLE TICKS``; the plant prints its
ticks per second.
"""

import sys
from time import perf_counter
from typing import Any

import formation_gnc_msgs.msg as messages
import rclpy
from rclpy.node import Node
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

from formation_gnc.nodes import topics
from formation_gnc.nodes.shell import Executor

ROLES = ("navigation", "guidance", "controller", "plant")
INPUTS = {
    "navigation": [(messages.Measurement, topics.MEASUREMENT)],
    "guidance": [(messages.Estimate, topics.ESTIMATE)],
    "controller": [(messages.Estimate, topics.ESTIMATE), (messages.Target, topics.TARGET)],
    "plant": [(messages.Thrust, topics.THRUST)],
}
OUTPUTS = {
    "navigation": [(messages.Estimate, topics.ESTIMATE), (messages.Timing, topics.TIMING)],
    "guidance": [(messages.Target, topics.TARGET), (messages.Timing, topics.TIMING)],
    "controller": [
        (messages.Thrust, topics.THRUST),
        (messages.Status, topics.STATUS),
        (messages.Timing, topics.TIMING),
    ],
    "plant": [
        (messages.Measurement, topics.MEASUREMENT),
        (messages.Truth, topics.TRUTH),
        (Clock, topics.CLOCK),
    ],
}


class Relay(Node):  # type: ignore[misc]
    """Answers when all its inputs of one stamp have come."""

    def __init__(self, role: str, ticks: int) -> None:
        """Connect as the graph's node of this role does."""
        super().__init__(role, namespace="deputy1")
        self.role, self.ticks, self.tick = role, ticks, 0
        self.done = Future()
        self.started = 0.0
        self.outputs = [
            (kind(), self.create_publisher(kind, topic, topics.quality())) for kind, topic in OUTPUTS[role]
        ]
        for message, _ in self.outputs:
            if isinstance(message, messages.Truth):
                message.deputies = [messages.SatelliteTruth(name="deputy1")]
        self.stamps: dict[str, int] = {}
        for kind, topic in INPUTS[role]:
            self.create_subscription(
                kind,
                topic,
                lambda message, topic=topic: self.receive(topic, message),
                topics.quality(topics.LATEST),
            )

    def receive(self, topic: str, message: Any) -> None:
        """Take an input, and answer when all are there."""
        self.stamps[topic] = message.header.stamp.sec
        if len(self.stamps) < len(INPUTS[self.role]) or len(set(self.stamps.values())) > 1:
            return
        if self.role != "plant":
            self.answer(message.header.stamp.sec)
        elif message.header.stamp.sec == self.tick:
            self.tick += 1
            if self.tick == self.ticks:
                self.done.set_result(None)
            else:
                self.answer(self.tick)

    def answer(self, tick: int) -> None:
        """Publish every output with the stamp of a tick."""
        for message, publisher in self.outputs:
            if isinstance(message, Clock):
                message.clock.sec = tick
            else:
                message.header = Header(frame_id="hill")
                message.header.stamp.sec = tick
            publisher.publish(message)

    def everyone_is_there(self) -> bool:
        """Whether the other roles have been discovered."""
        return {*ROLES} <= {name for name, _ in self.get_node_names_and_namespaces()}


def main(role: str, ticks: int) -> None:
    """Relay until told to stop; the plant until all ticks have passed."""
    rclpy.init()
    node = Relay(role, ticks)
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
    main(sys.argv[1], int(sys.argv[2]))
