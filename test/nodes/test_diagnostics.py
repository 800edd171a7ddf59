"""Every node says on `/diagnostics` how it is: waiting and trouble are no good states."""

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from formation_gnc.flight.graph import MODULES
from formation_gnc.sil.report import Report
from formation_gnc.transport.diagnostics import RUN, DiagnosticsPublisher, subscribe_to_reports

from .conftest import MAKERS, Bench

pytestmark = pytest.mark.sil


def statuses(bench: Bench) -> list[Any]:
    heard: list[Any] = []
    bench.user.create_subscription(DiagnosticArray, "/diagnostics", lambda each: heard.extend(each.status), 100)
    return heard


@pytest.mark.parametrize("name", MAKERS)
def test_every_node_has_a_status_and_waiting_is_a_warning(bench: Bench, name: str) -> None:
    heard = statuses(bench)
    node = bench.make(name)
    if name == "plant":
        bench.spin(node, until=lambda: node.executive.check(0.0) or bool(heard))
    bench.spin(node, until=lambda: bool(heard))
    (status, *_) = heard
    assert status.name == (RUN if name == "plant" else f"formation_gnc: {node.get_fully_qualified_name()}")
    assert status.hardware_id == ("/deputy1" if name in MODULES else "/")
    assert status.level == (DiagnosticStatus.OK if name == "replay" else DiagnosticStatus.WARN)
    assert "waiting for" in status.message or name == "replay"


def test_troubles_of_a_run_are_errors_and_come_back_as_a_report(bench: Bench) -> None:
    heard, reports = statuses(bench), list[Report]()
    subscribe_to_reports(bench.user, reports.append)
    publisher = DiagnosticsPublisher(bench.user, "/", RUN)
    foreign = bench.user.create_publisher(DiagnosticArray, "/diagnostics", 10)
    foreign.publish(DiagnosticArray(status=[DiagnosticStatus(name="battery", values=[KeyValue(key="v", value="low")])]))
    given = [
        Report("flying", {"misses": 0.0}),
        Report("flying", {"misses": 1.0}),
        Report("flying", {"misses": 0.0}, ("a",)),
    ]
    for report in given:
        publisher.publish_report(report, 0)
    bench.spin(until=lambda: len(reports) == 3 and sum(each.name == RUN for each in heard) == 3)
    assert reports == given
    levels = [each.level for each in heard if each.name == RUN]
    assert levels == [DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR]
