"""Processes of a run's node graph, as they are started."""

from pathlib import Path
from typing import Any

import pytest

from formation_gnc.transport import processes
from formation_gnc.transport.processes import Graph


def test_nodes_get_the_variables_of_their_start_as_of_their_enclaves(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    started: list[tuple[Any, ...]] = []

    class Server:
        def start(self, *given: Any) -> None:
            started.append(given)

    monkeypatch.setattr(processes, "fork_server", Server)
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    graph = Graph(42, tmp_path)
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", "/keys")  # after the graph is made, as for one flight's own keystore
    graph.start("/deputy1/navigation", ["-p", "tick:=1.0"])
    ((path, arguments, environment, log),) = started
    assert path.name == "navigation"
    assert arguments[:5] == ["--ros-args", "-r", "__ns:=/deputy1", "--enclave", "/deputy1/navigation"]
    assert environment["ROS_SECURITY_KEYSTORE"] == "/keys"
    assert environment["ROS_DOMAIN_ID"] == "42"
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert log == tmp_path / "deputy1.navigation.log"
