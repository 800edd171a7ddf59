"""Permissions against what the nodes of a live flight really publish, hear, serve and call."""

from fnmatch import fnmatchcase
from pathlib import Path

import pytest
import rclpy
from rclpy.context import Context

from formation_gnc.flight.access import LAUNCHER, Access, access_by_process
from formation_gnc.flight.graph import MODULES
from formation_gnc.sil.report import Report
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.dds_security import published, subscribed
from formation_gnc.transport.launcher import LaunchOptions, fly_graph

from .conftest import DEADLINE, wait_until

Endpoints = dict[str, tuple[set[str], set[str]]]
"""By node: DDS names of what it writes and reads."""


class SeenError(Exception):
    """Ends a flight of which enough has been seen."""


def endpoints(domain: int, wanted: set[str]) -> Endpoints:
    """Those of every node of a domain, as discovery tells them when all wanted are there."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = rclpy.create_node("onlooker", context=context, start_parameter_services=False)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        wait_until(lambda: wanted <= {f"{place.rstrip('/')}/{name}" for name, place in nodes(node)}, "all nodes")
        executor.spin_once_until_future_complete(rclpy.task.Future(), timeout_sec=1.0)  # for their endpoints
        found: Endpoints = {}
        for name, namespace in nodes(node):
            writes = node.get_publisher_names_and_types_by_node(name, namespace, no_demangle=True)
            reads = node.get_subscriber_names_and_types_by_node(name, namespace, no_demangle=True)
            found[f"{namespace.rstrip('/')}/{name}"] = {each for each, _ in writes}, {each for each, _ in reads}
        del found["/onlooker"]
        return found
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def nodes(node: rclpy.node.Node) -> list[tuple[str, str]]:
    return list(node.get_node_names_and_namespaces())


def unpermitted(names: set[str], patterns: frozenset[str]) -> list[str]:
    return sorted(name for name in names if not any(fnmatchcase(name, pattern) for pattern in patterns))


def access_of(node: str, accesses: dict[str, Access], composed: bool) -> Access:
    deputy, _, kind = node.rpartition("/")
    return accesses[f"{deputy}/satellite" if composed and kind in MODULES else node]


@pytest.mark.sil
@pytest.mark.parametrize(("name", "composed"), [("leader_follower", False), ("tetrahedral", True)])
def test_nodes_of_a_flight_keep_to_their_permissions_and_use_them(tmp_path: Path, name: str, composed: bool) -> None:
    tick = load_scenario(name).plant.tick
    paced = {"duration": 2000.0 * tick, "real_time_factor": 10.0 * tick, "deadline": DEADLINE}
    scenario = load_scenario(name, {"/plant": paced})
    domain, seen = 0, Endpoints()
    modules = {f"/{deputy}/{module}" for deputy in scenario.plant.deputies for module in MODULES}
    wanted = {"/plant", "/recorder", "/display", LAUNCHER, *modules}

    def hear(line: str) -> None:
        nonlocal domain
        domain = int(line.partition("=")[2])

    def tell(report: Report) -> None:
        if report.figures.get("tick", 0.0) > 5.0:
            seen.update(endpoints(domain, wanted))
            raise SeenError

    with pytest.raises(SeenError):
        fly_graph(scenario, LaunchOptions(tmp_path / "bag", composed=composed, display=True), tell, hear)
    accesses = access_by_process(scenario.plant.deputies)
    assert seen.keys() == wanted
    for node, (writes, reads) in seen.items():
        access = access_of(node, accesses, composed)
        assert unpermitted(writes, published(access)) == [], node
        assert unpermitted(reads, subscribed(access)) == [], node
    # Nothing is granted for nothing, but the clock of use_sim_time and what is there in other installations.
    for deputy in scenario.plant.deputies:
        for module in MODULES:
            access = accesses[f"/{deputy}/{module}"]
            writes, _ = seen[f"/{deputy}/{module}"]
            assert {f"rt{topic}" for topic in access.publishes} <= writes | {"rt/events"}
