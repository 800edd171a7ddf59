"""The recorder node: every topic, byte for byte, into an MCAP bag."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from time import monotonic
from typing import Any

from rcl_interfaces.msg import ParameterType
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from formation_gnc.common import CommonParameters
from formation_gnc.parameters import parameter, to_json
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.loss import LossCounter
from formation_gnc.recording.provenance import LOST, parameters_record, provenance
from formation_gnc.recording.snapshot import Snapshot
from formation_gnc.recording.writer import FLUSH_INTERVAL, BagWriter, Split
from formation_gnc.records import Event, EventKind
from formation_gnc.transport import topics
from formation_gnc.transport.conversion import codec
from formation_gnc.transport.node import ConfiguredNode, asked_to_stop, run
from formation_gnc.transport.raw_topics import Hear, RawTopics
from formation_gnc.types import NANOSECONDS

LOOK_PERIOD = 0.1
"""Wall time (s) between looks for new topics and nodes, and between reports of progress."""

ASK_AGAIN = 2.0
"""Wall time (s) after which a node is asked for its parameters again: ROS gives up an answer to who is
not yet known to listen, which happens when many nodes start on a busy machine."""

REPORT_TICKS = 64
"""Ticks after which progress is reported at the latest."""

QUIET = 0.2
"""Wall time (s) that a recorder which is told to stop listens without a message before it believes that all
has come. It is listening that counts: one that gets no processor has heard nothing either."""


@dataclass(frozen=True)
class RecorderParameters(CommonParameters):
    """Where to record to, and how much."""

    bag: str = parameter("", doc="directory to make for the bag; empty for bags/ and the date and time")
    split_size: int = parameter(
        0, unit="B", minimum=0, doc="messages on disk after which the bag goes on in a next file; 0 for never"
    )
    split_duration: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        doc="simulated time after which the bag goes on in a next file; 0 for never",
    )
    snapshot: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        doc="record nothing but, whenever the service ~/snapshot is called, this much simulated time up to "
        "then; 0 for recording everything",
    )


class RecorderNode(ConfiguredNode):
    """Subscribes to every topic there is and writes what comes, as it came.

    failure: why the disk took no more, once that has happened; from then on nothing is recorded.
    """

    def __init__(self) -> None:
        """Make the bag; raises ConfigurationError if its directory exists."""
        super().__init__("recorder", RecorderParameters)
        values = self.values
        directory = values.bag or f"bags/{datetime.now(UTC):%Y-%m-%d_%H-%M-%S}"
        files = _parameter_files(sys.argv)
        self._scenario = files[0].stem if files else ""
        self.bag = BagWriter(
            Path(directory),
            provenance(),
            {file.name: file.read_bytes() for file in files},
            Split(values.split_size or None, values.split_duration or None),
        )
        self.failure: OSError | None = None
        self.get_logger().info(f"recording to {directory}")
        self._progress = self.create_publisher(Clock, topics.RECORDED, topics.quality(topics.LATEST))
        self._write = self.bag.write
        if values.snapshot:
            self._snapshot = Snapshot(self.bag, values.snapshot)
            self._write = self._snapshot.write
            self.create_service(Trigger, "~/snapshot", self._on_snapshot)
        self._topics = RawTopics(self, self._open)
        self._counts: dict[str, int] = {}
        self._losses: dict[str, LossCounter] = {}
        self._lost = 0
        self._askable: dict[str, AsyncParameterClient] = {}
        self._unknown: dict[str, str] = {}
        self._asked: dict[str, float] = {}
        self._settings: dict[str, dict[str, Any]] = {}
        self._heard: dict[str, int] = {}
        self._answered: dict[str, dict[str, int]] = {}
        self._missed: dict[str, int] = {}
        self._told = -1
        self._read_event = codec(Event).decode
        self._reported: int | None = None
        self._is_quiet = False
        self.create_timer(LOOK_PERIOD, self._while_disk_lasts(self._look))
        self.create_timer(FLUSH_INTERVAL, self._while_disk_lasts(self.bag.flush))

    def is_quiet(self) -> bool:
        """Whether nothing has come since this was last asked; not before it is asked twice."""
        quiet, self._is_quiet = self._is_quiet, True
        return quiet

    def close(self) -> None:
        """Finish the bag."""
        if self.failure is None:
            self.bag.add_metadata(LOST, {topic: str(each.lost) for topic, each in self._losses.items()})
            self.bag.close()

    def _while_disk_lasts(self, work: Callable[..., None]) -> Callable[..., None]:
        """Do `work` until the disk fails; an executor would lose the error."""

        def guarded(*arguments: Any) -> None:
            if self.failure is None:
                try:
                    work(*arguments)
                except OSError as failure:
                    self.failure = failure

        return guarded

    def _look(self) -> None:
        self._topics.look()
        for service, _ in self.get_service_names_and_types():
            node, _, kind = service.rpartition("/")
            if kind == "get_parameters" and node not in self._askable:
                self._askable[node] = AsyncParameterClient(self, node)
                self._unknown[node] = parameters_record(node)
        for node, record_name in self._unknown.items():
            client = self._askable[node]
            is_due = monotonic() - self._asked.get(node, -ASK_AGAIN) >= ASK_AGAIN
            if is_due and client.services_are_ready():
                self._asked[node] = monotonic()
                self._ask_parameters(node, record_name)
        if self._knows_the_run():
            self._report()
        self._say_what_is_lost()

    def _knows_the_run(self) -> bool:
        """Whether the parameters of the plant and of every deputy's nodes are on record."""
        deputies = self._settings.get("/plant", {}).get("deputies", ())
        nodes = [f"/{deputy}/{part}" for deputy in deputies for part in topics.PARTS]
        return bool(nodes) and all(self._settings.get(node) for node in nodes)

    def _open(self, topic: str, type_name: str, latched: bool) -> Hear:
        self.bag.add_topic(topic, type_name, topics.DEPTH)
        self._counts[topic] = 0
        loss = self._losses[topic] = LossCounter(lambda: self.count_publishers(topic), latched)
        is_clock, is_events = topic == topics.CLOCK, topic == topics.EVENTS
        namespace, _, name = topic.rpartition("/")
        node = next((f"{namespace}/{part}" for part, answer in topics.PARTS.items() if answer == name), "")
        stamps: dict[str, int] | None = None
        if is_clock or topic == topics.TRUTH or name == topics.MEASUREMENT:
            stamps = self._heard
        elif node:
            stamps = self._answers_of(namespace)

        def hear(data: bytes, stamp: int, number: int | None) -> None:
            self._is_quiet = False
            count = self._counts[topic] = self._counts[topic] + 1
            if number is not None:
                loss.take(number)
            if number == 1 and count > 1 and node in self._askable:  # it was started again
                self._unknown[node] = parameters_record(node, stamp)
                self._asked.pop(node, None)
            self._write(topic, data, stamp, number or count)
            if is_clock and stamp < self._heard.get(topic, 0):
                self._forget_progress()  # the plant was started again
            if stamps is not None:
                stamps[topic] = stamp
            elif is_events:
                self._hear_event(data)
            if is_clock and count % REPORT_TICKS == 0:
                self._report()

        return self._while_disk_lasts(hear)

    def _report(self) -> None:
        """Tell the plant up to which stamp all is recorded: tick by tick, then its end.

        That is what the plant publishes at every tick, and every deputy's answers or that it missed.
        """
        stamps = set(self._heard.values())
        for topic in self._heard:
            deputy, _, name = topic.rpartition("/")
            if name == topics.MEASUREMENT:
                stamps.add(max(min(self._answers_of(deputy).values()), self._missed.get(deputy, -1)))
        recorded = min(stamps, default=-1)
        if len(stamps) == 1 and self._told > recorded:  # nothing but the end is stamped after a tick
            recorded = self._told
        if recorded != self._reported:
            self._reported = recorded
            progress = Clock()
            progress.clock.sec, progress.clock.nanosec = divmod(recorded, NANOSECONDS)
            self._progress.publish(progress)

    def _answers_of(self, deputy: str) -> dict[str, int]:
        """Latest stamps of a deputy's answers by topic, -1 for none."""
        none = {f"{deputy}/{answer}": -1 for answer in topics.PARTS.values()}
        return self._answered.setdefault(deputy, none)

    def _hear_event(self, data: bytes) -> None:
        event = self._read_event(data)
        self._told = event.time
        if event.kind == EventKind.MISS:
            self._missed[f"/{event.subject}"] = event.time

    def _forget_progress(self) -> None:
        self._told = -1
        self._heard.clear()
        self._missed.clear()
        for answers in self._answered.values():
            answers.update(dict.fromkeys(answers, -1))

    def _say_what_is_lost(self) -> None:
        lost = {topic: each.lost for topic, each in self._losses.items() if each.lost}
        if sum(lost.values()) > self._lost:
            self._lost = sum(lost.values())
            self.get_logger().warning(f"lost so far: {', '.join(f'{n} of {t}' for t, n in lost.items())}")

    def _on_snapshot(self, _request: Any, response: Any) -> Any:
        def write() -> None:
            response.message = f"{self._snapshot.trigger()} messages written to {self.bag.directory}"
            response.success = True

        self._while_disk_lasts(write)()
        if not response.success:
            response.message = str(self.failure)
        return response

    def _ask_parameters(self, node: str, record_name: str) -> None:
        """Ask a node for all its parameters, for the record of this name."""
        client = self._askable[node]

        def on_list(answer: Future) -> None:
            names = list(answer.result().result.names)
            client.get_parameters(names, callback=lambda values: on_values(names, values))

        def on_values(names: list[str], answer: Future) -> None:
            if self._unknown.get(node) != record_name:
                return  # asked twice, and answered twice, or started again meanwhile
            del self._unknown[node]
            self._settings[node] = {
                name: parameter_value_to_python(value)
                for name, value in zip(names, answer.result().values, strict=True)
                if value.type != ParameterType.PARAMETER_NOT_SET
            }
            self._while_disk_lasts(self._put_on_record)(node, record_name, self._settings[node])

        client.list_parameters(callback=on_list)

    def _put_on_record(self, node: str, record_name: str, values: dict[str, Any]) -> None:
        """Write parameters at once, so that a bag that is cut short can be flown again."""
        here = ("bag",) if node == self.get_fully_qualified_name() else ()  # where, not how, it was recorded
        recorded = {name: to_json(value) for name, value in values.items() if name not in here}
        self.bag.add_metadata(record_name, recorded)
        if record_name == parameters_record("/plant"):
            self.bag.add_metadata("run", {"scenario": self._scenario, "seed": str(values.get("seed", ""))})
            self.bag.add_attachment(LAYOUT, foxglove_layout(values.get("deputies", ())).encode())


def _parameter_files(arguments: list[str]) -> list[Path]:
    """Parameter files that a node was started with."""
    return [Path(file) for flag, file in pairwise(arguments) if flag == "--params-file"]


def record(node: RecorderNode) -> None:
    """Record until told to stop, and then until nothing more comes; raises OSError when the disk fails."""
    try:
        node.spin(lambda: asked_to_stop() or node.failure is not None)
        node.spin(lambda: node.is_quiet() or node.failure is not None, lambda: QUIET)
    finally:
        node.close()
    if node.failure is not None:
        raise node.failure


def main() -> int:
    """Run the node."""
    return run(RecorderNode, record)
