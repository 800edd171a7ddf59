"""The recorder node: every topic, byte for byte, into an MCAP bag."""

import sys
from datetime import UTC, datetime
from functools import partial
from itertools import count, pairwise
from pathlib import Path
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from formation_gnc.flight import topics
from formation_gnc.messages.conversion import codec
from formation_gnc.recording.parameters import RecorderParameters
from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.session import RecordingSession
from formation_gnc.recording.writer import FLUSH_INTERVAL, BagWriter, Split
from formation_gnc.records import Clock, Event
from formation_gnc.transport.diagnostics import PERIOD, DiagnosticsPublisher
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.parameter_reader import ParameterReader
from formation_gnc.transport.presence import announce
from formation_gnc.transport.qos import LATEST
from formation_gnc.transport.raw_topics import Callback, RawTopics
from formation_gnc.types import NANOSECONDS

LOOK_PERIOD = 0.1
"""Wall time (s) between looks for new topics and nodes, and between reports of progress."""

QUIET = 0.2
"""Wall time (s) without a message, while spinning, after which a stopping recorder has drained its queues."""


class RecorderNode(ConfiguredNode):
    """Carries every topic's messages, and the parameters of every node, to a recording session."""

    def __init__(self) -> None:
        """Make the bag; where its directory exists, as of a recorder that died, in the next one that does not."""
        super().__init__("recorder", RecorderParameters)
        values = self.values
        wanted = Path(values.bag or f"bags/{datetime.now(UTC):%Y-%m-%d_%H-%M-%S}")
        directory = free_directory(wanted)
        files = [Path(file) for flag, file in pairwise(sys.argv) if flag == "--params-file"]
        attachments = {file.name: file.read_bytes() for file in files}
        split = Split(values.split_size or None, values.split_duration or None)
        report = self.publisher_of(Clock, topics.PROGRESS.name, LATEST)
        self.session = RecordingSession(
            BagWriter(directory, provenance(), attachments, split),
            files[0].stem if files else "",
            lambda stamp: report(Clock(stamp)),
            codec(Event).decode,
            values.snapshot,
        )
        self.get_logger().info(f"recording to {directory}")
        self._presence = announce(self)
        if directory != wanted:
            self.warn(topics.PROGRESS.name, f"{wanted} exists already: recording to {directory}")
        self._diagnostics = DiagnosticsPublisher(self, self.full_name("") or "/")
        self.create_wall_timer(PERIOD, self._diagnose)
        self._raw_topics = RawTopics(self, self._open, self.full_name(""))
        self._reader = ParameterReader(self)
        if values.snapshot:
            self.create_service(Trigger, "~/snapshot", self._on_snapshot)
        self.create_wall_timer(LOOK_PERIOD, self.session.while_disk_lasts(self._look))
        self.create_wall_timer(FLUSH_INTERVAL, self.session.while_disk_lasts(self.session.bag.flush))

    def _open(self, topic: str, type_name: str, latched: bool) -> Callback:
        return self.session.open_topic(topic, type_name, partial(self.identities_on, topic), latched)

    def _look(self) -> None:
        session, now = self.session, monotonic()
        self._raw_topics.look()
        nodes = session.parameters.find(self._reader.nodes(), self.full_name("/"), self.publishers_of, now)
        for node, record in session.parameters.due(now).items():
            if node not in nodes:
                continue
            left_out = ("bag",) if nodes[node] == self.get_fully_qualified_name() else ()  # where, not how
            take = session.while_disk_lasts(partial(session.put_on_record, node, record, left_out=left_out))
            if self._reader.ask(nodes[node], take):
                session.parameters.asked(node, now)
        if session.parameters.is_complete(now):
            session.report_progress()
        for topic, text in session.look():
            self.warn(topic, text)
        for text in session.new_troubles():
            self.get_logger().warning(text)

    def simulated_time(self) -> int:
        """Stamp (ns) up to which everything is recorded."""
        return max(0, self.session.progress.stamp)

    def destroy_node(self) -> None:
        """Leave the graph, and show no longer that the process lives."""
        super().destroy_node()
        if self._presence is not None:
            self._presence.close()

    def _diagnose(self) -> None:
        failure, lost, stamp = self.session.failure, self.session.lost, self.session.progress.stamp
        level, message = DiagnosticStatus.OK, "recording"
        if awaited := self.session.progress.awaited(monotonic()):
            level, message = DiagnosticStatus.WARN, f"waiting for {' and '.join(awaited)}"
        elif lost:
            level, message = DiagnosticStatus.WARN, "messages were lost"
        elif stamp < 0:
            level, message = DiagnosticStatus.WARN, "waiting for a run"
        if failure is not None:
            level, message = DiagnosticStatus.ERROR, str(failure)
        values = {"bag": self.session.bag.directory, "recorded_to": max(0, stamp) / NANOSECONDS, "lost": lost}
        self._diagnostics.publish(level, message, values, stamp)

    def _on_snapshot(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self.session.write_snapshot()
        return response


def free_directory(wanted: Path) -> Path:
    """The directory wanted, or, where a bag is, the first with a number behind its name that does not exist."""
    if not (wanted.is_dir() and (any(wanted.glob("*.mcap")) or (wanted / "metadata.yaml").exists())):
        return wanted  # of anything else the writer says what is wrong
    numbered = (wanted.with_name(f"{wanted.name}_{number}") for number in count(2))
    return next(each for each in numbered if not each.exists())
