"""Every node of the package, made in this process, and a user who speaks to it as the tools of ROS do."""

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import domain_coordinator
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from formation_gnc.flight.graph import MODULES
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import find_scenario, load_scenario
from formation_gnc.transport.display_node import DisplayNode
from formation_gnc.transport.module_node import ModuleNode
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.plant_node import PlantNode
from formation_gnc.transport.recorder_node import RecorderNode
from formation_gnc.transport.replay_node import ReplayNode

PATIENCE = 30.0  # s of wall time, for a machine that is busy with other things

MAKERS: dict[str, Callable[[], ConfiguredNode]] = {
    "plant": PlantNode,
    **{name: (lambda row=row: ModuleNode(row)) for name, row in MODULES.items()},
    "recorder": RecorderNode,
    "display": DisplayNode,
    "replay": ReplayNode,
}
"""How each executable makes its node."""


@pytest.fixture(scope="session")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of a flight of ten ticks."""
    path = tmp_path_factory.mktemp("flown") / "bag"
    with BagWriter(path, provenance(), {}) as bag:
        Run(load_scenario("leader_follower", {"/plant": {"duration": 10.0}})).fly(InProcessRecorder(bag))
    return path


class Bench:
    """Makes nodes as their executables do, and calls their services."""

    def __init__(self, directory: Path, flown: Path) -> None:
        self.directory, self.flown = directory, flown
        self.scenario = find_scenario("leader_follower")
        self.nodes: list[ConfiguredNode] = []
        self.user: Node = rclpy.create_node("user", start_parameter_services=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.user)

    def make(self, name: str, *arguments: str, files: tuple[Path, ...] | None = None) -> ConfiguredNode:
        """The node of an executable started with these arguments, on the default scenario or these files."""
        given = [word for file in (files or (self.scenario,)) for word in ("--params-file", str(file))]
        if name == "recorder":
            given += ["-p", f"bag:={self.directory / f'bag{len(self.nodes)}'}"]
        elif name == "replay":
            given += ["-p", f"bag:={self.flown}"]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", [name, "--ros-args", *given, *arguments])
            node = MAKERS[name]()
        self.nodes.append(node)
        return node

    def spin(self, *nodes: ConfiguredNode, until: Callable[[], bool] = lambda: True, rounds: int = 3000) -> None:
        """Serve nodes and the user in turn, at least once each."""
        for _ in range(rounds):
            for node in nodes:
                once = iter([False, True])
                node.spin(lambda once=once: next(once), lambda: 0.005)  # type: ignore[misc]
            self.executor.spin_once(timeout_sec=0.005)
            if until():
                return
        pytest.fail("not within patience")

    def call(self, node: ConfiguredNode, kind: Any, name: str, request: Any) -> Any:
        """Call a service of a node."""
        client = self.user.create_client(kind, f"{node.get_fully_qualified_name()}/{name}")
        assert client.wait_for_service(timeout_sec=PATIENCE)
        answer = client.call_async(request)
        self.spin(node, until=answer.done)
        self.user.destroy_client(client)
        return answer.result()

    def clear(self) -> None:
        for node in self.nodes:
            if isinstance(node, RecorderNode):
                with suppress(ValueError):  # closed already
                    node.session.close()
            node.destroy_node()
        self.executor.shutdown()
        self.user.destroy_node()


@pytest.fixture
def bench(tmp_path: Path, flown: Path) -> Iterator[Bench]:
    with domain_coordinator.domain_id() as domain:
        rclpy.init(domain_id=domain)
        bench = Bench(tmp_path, flown)
        try:
            yield bench
        finally:
            try:
                bench.clear()
            finally:
                rclpy.shutdown()
                gc.collect()  # what is still held would publish on
