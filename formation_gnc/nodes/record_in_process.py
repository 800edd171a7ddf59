"""Records an in-process run as the recorder node would record the node graph."""

from collections.abc import Callable
from typing import Any

from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from formation_gnc import interface
from formation_gnc.interface import NANOSECONDS
from formation_gnc.nodes import topics
from formation_gnc.nodes.conversion import message_type, to_message
from formation_gnc.recording.decode import installed_type
from formation_gnc.recording.writer import BagWriter


class InProcessRecorder:
    """A sink for :class:`formation_gnc.sil.runner.Run` that writes every record to a bag."""

    def __init__(self, bag: BagWriter) -> None:
        """Write to a bag, which is closed by the one who made it."""
        self._bag = bag
        self._counts: dict[str, int] = {}
        self._canonical: dict[str, Callable[[bytes], bytes]] = {}

    def __call__(self, topic: str, record: Any) -> None:
        """Write one record; the clock follows each truth, as the plant publishes it."""
        kind: Any = type(record)
        self._write(topic, to_message(record), message_type(kind), record.time)
        if isinstance(record, interface.Truth):
            clock = Clock()
            clock.clock.sec, clock.clock.nanosec = divmod(record.time, NANOSECONDS)
            self._write(topics.CLOCK, clock, Clock, record.time)

    def _write(self, topic: str, message: Any, kind: Any, time: int) -> None:
        if topic not in self._counts:
            type_name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
            self._bag.add_topic(topic, type_name, topics.DEPTH)
            self._counts[topic] = 0
            self._canonical[topic] = installed_type(type_name).canonical
        self._counts[topic] += 1
        # serialize_message leaves what was in memory in the gaps between fields; DDS does not
        data = self._canonical[topic](serialize_message(message))
        self._bag.write(topic, data, time, self._counts[topic])
