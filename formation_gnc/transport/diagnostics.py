"""The state of a run and of its nodes on `/diagnostics`."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from formation_gnc.flight import topics
from formation_gnc.flight.module import Condition
from formation_gnc.sil.report import Report
from formation_gnc.transport.qos import quality
from formation_gnc.types import NANOSECONDS

PERIOD = 0.5
"""Wall time (s) between two messages of a node."""

RUN = "formation_gnc: run"
"""Name of the status that is the run's report; that of a node is `formation_gnc: ` and its full name."""


LEVELS = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR)
"""By level of a condition."""


class DiagnosticsPublisher:
    """Publishes how a node is doing."""

    def __init__(self, node: Node, hardware: str, name: str = "") -> None:
        """Publish as a node, for a satellite or formation; `name` of the status, by default the node's."""
        self._name, self._hardware = name or f"formation_gnc: {node.get_fully_qualified_name()}", hardware
        self._publisher = node.create_publisher(DiagnosticArray, topics.DIAGNOSTICS.name, quality())

    def publish(
        self, level: bytes, message: str, values: Mapping[str, Any], time: int, parts: Sequence[Condition] = ()
    ) -> None:
        """Publish a state at a simulated time, ns; that of each part is below the node's."""
        statuses = [self._status(self._name, level, message, values)]
        statuses += [
            self._status(f"{self._name}: {each.name}", LEVELS[each.level], each.message, each.values) for each in parts
        ]
        array = DiagnosticArray(status=statuses)
        array.header.stamp.sec, array.header.stamp.nanosec = divmod(max(0, time), NANOSECONDS)
        self._publisher.publish(array)

    def _status(self, name: str, level: bytes, message: str, values: Mapping[str, Any]) -> DiagnosticStatus:
        status = DiagnosticStatus(level=level, name=name, message=message, hardware_id=self._hardware)
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        return status

    def publish_report(self, report: Report, time: int) -> None:
        """Publish a report of the run at a simulated time, ns: a run that waits or misses ticks is no good one."""
        level = DiagnosticStatus.OK
        if report.figures["misses"] or report.message not in ("flying", "finished"):
            level = DiagnosticStatus.WARN
        if report.troubles:
            level = DiagnosticStatus.ERROR
        self.publish(level, "; ".join((report.message, *report.troubles)), report.figures, time)


def subscribe_to_reports(node: Node, callback: Callable[[Report], None]) -> None:
    """Call back with every report of the run."""

    def receive(array: DiagnosticArray) -> None:
        for status in array.status:
            if status.name == RUN:
                message, *troubles = status.message.split("; ")
                with suppress(ValueError):  # another's, in our name
                    figures = {each.key: float(each.value) for each in status.values}
                    callback(Report(message, figures, tuple(troubles)))

    node.create_subscription(DiagnosticArray, topics.DIAGNOSTICS.name, receive, quality())
