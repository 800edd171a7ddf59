"""The state of a run on `/diagnostics`."""

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from formation_gnc.flight import topics
from formation_gnc.sil.plant_executive import Report
from formation_gnc.transport.qos import LATEST, quality
from formation_gnc.types import NANOSECONDS


class ReportPublisher:
    """Publishes reports of the run."""

    def __init__(self, node: Node) -> None:
        """Publish as a node."""
        self._publisher = node.create_publisher(DiagnosticArray, topics.DIAGNOSTICS.name, quality())

    def __call__(self, report: Report, time: int) -> None:
        """Publish a report at a simulated time, ns."""
        level = DiagnosticStatus.WARN if report.figures["misses"] else DiagnosticStatus.OK
        values = [KeyValue(key=key, value=str(value)) for key, value in report.figures.items()]
        status = DiagnosticStatus(level=level, name="formation_gnc: run", message=report.message, values=values)
        array = DiagnosticArray(status=[status])
        array.header.stamp.sec, array.header.stamp.nanosec = divmod(time, NANOSECONDS)
        self._publisher.publish(array)


def subscribe_to_reports(node: Node, callback: Callable[[Report], None]) -> None:
    """Call back with every report of the run."""

    def receive(array: DiagnosticArray) -> None:
        for status in array.status:
            callback(Report(status.message, {each.key: float(each.value) for each in status.values}))

    node.create_subscription(DiagnosticArray, topics.DIAGNOSTICS.name, receive, quality(LATEST))
