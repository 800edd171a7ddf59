"""Starts a run's node graph as `ros2 run` would, watches it, and stops all of it."""

import ctypes
import json
import os
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import domain_coordinator
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import dump
from formation_gnc.sil.scenario import Scenario
from formation_gnc.transport import topics

PR_SET_PDEATHSIG = 1  # from <linux/prctl.h>
GRACE = 2.0
"""Wall time (s) that nodes have to stop when asked; whoever is left then is killed."""

TIME_TO_CLOSE = 10.0
"""Wall time (s) that the recorder has to close its bag, which takes long on a busy machine."""

LAST_WORD = 1.0
"""Wall time (s) after the plant's end in which its last report is waited for."""


class NodeDied(RuntimeError):
    """A node ended that should not have; the message says which and why."""


@dataclass
class NodeProcess:
    """A running node."""

    name: str
    process: subprocess.Popen[bytes]
    log: Path

    def reason(self) -> str:
        """Why it ended, in words, with the last thing it said."""
        code = self.process.returncode
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
        lines = self.log.read_text(errors="replace").strip().splitlines()
        return how + (f": {lines[-1]}" if lines else "")


def executable(node: str) -> Path:
    """Path of a node's executable, where `ros2 run formation_gnc` finds it."""
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        path = Path(prefix) / "lib" / "formation_gnc" / node
        if path.is_file():
            return path
    raise ConfigurationError(f"node {node}: not installed; build with colcon, and source env.sh or install/setup.bash")


class Graph:
    """All processes of a run, in a ROS domain of their own."""

    def __init__(self, domain: int, directory: Path) -> None:
        """Start nothing yet; logs go to `directory`."""
        self.nodes: list[NodeProcess] = []
        self._environment = os.environ | {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
        }
        self._directory = directory

    def start(self, name: str, arguments: list[str]) -> NodeProcess:
        """Start the node of this full name, such as ``/deputy1/controller``, in a session of its own."""
        namespace, _, kind = name.rpartition("/")
        remap = ["-r", f"__ns:={namespace}"] if namespace else []
        log = self._directory / f"{name.strip('/').replace('/', '.')}.log"
        with log.open("wb") as stream:
            process = subprocess.Popen(
                [executable(kind), "--ros-args", *remap, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
                preexec_fn=_end_with_parent,  # before any thread is there that could hold a lock
            )
        node = NodeProcess(name, process, log)
        self.nodes.append(node)
        return node

    def check(self) -> None:
        """Raise NodeDied if a node has ended with an error."""
        for node in self.nodes:
            if node.process.poll() not in (None, 0):
                raise NodeDied(f"{node.name} ended: {node.reason()}")

    def stop(self) -> None:
        """Stop every node, the recorder last, since it hears the others out; by force what does not stop."""
        for kind in (False, True):
            group = [node for node in self.nodes if node.name.endswith("/recorder") is kind]
            _signal(group, signal.SIGINT)
            _wait(group, GRACE / 2 if not kind else TIME_TO_CLOSE)
            _signal(group, signal.SIGKILL)
        _wait(self.nodes, GRACE)


def _end_with_parent() -> None:
    """Let the kernel send SIGTERM to this process when the one that started it is gone, however it went."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def _signal(nodes: list[NodeProcess], number: signal.Signals) -> None:
    for node in nodes:
        if node.process.poll() is None:
            os.killpg(node.process.pid, number)


def _wait(nodes: list[NodeProcess], seconds: float) -> None:
    end = monotonic() + seconds
    while monotonic() < end and any(node.process.poll() is None for node in nodes):
        sleep(0.02)


@dataclass(frozen=True)
class Report:
    """Where the run is, from the plant's diagnostics."""

    message: str
    figures: Mapping[str, float]


@contextmanager
def _noted_interrupts() -> Iterator[Callable[[], None]]:
    """A function that raises KeyboardInterrupt if SIGINT or SIGTERM has come.

    Raised by the handler itself it could strike inside rclpy, which now and then swallows it.
    """
    noted: list[int] = []
    previous = {
        number: signal.signal(number, lambda number, _: noted.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }

    def check() -> None:
        if noted:
            raise KeyboardInterrupt

    try:
        yield check
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def _listener(domain: int, hear: Callable[[Report], None]) -> Iterator[Callable[[float], None]]:
    """A function that listens to the run's diagnostics for a time (s)."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("sil", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def receive(array: DiagnosticArray) -> None:
        for status in array.status:
            hear(Report(status.message, {each.key: float(each.value) for each in status.values}))

    node.create_subscription(DiagnosticArray, topics.DIAGNOSTICS, receive, topics.quality(topics.LATEST))
    try:
        yield lambda seconds: executor.spin_once(timeout_sec=seconds)
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def fly_graph(
    scenario: Scenario,
    bag: Path | None,
    show: Callable[[Report], None],
    announce: Callable[[str], None],
    composed: bool = False,
    display: bool = False,
) -> Report:
    """Fly a scenario on the node graph.

    Args:
        scenario: what to fly.
        bag: directory to record to; none for no recorder.
        show: called with the run's progress as it is reported.
        announce: called once with a line that says where the graph can be watched.
        composed: one process for each satellite, not one for each of its nodes.
        display: start the display node too.

    Returns:
        The last report of the plant.

    Raises:
        NodeDied: a node ended before the run did; everything else has been stopped and the bag is closed.
    """
    last = Report("starting", {})

    def hear(report: Report) -> None:
        nonlocal last
        last = report
        show(report)

    with (
        tempfile.TemporaryDirectory(prefix="formation_gnc-") as directory,
        domain_coordinator.domain_id() as domain,
        _noted_interrupts() as raise_if_interrupted,
    ):
        file = Path(directory) / f"{scenario.name}.yaml"
        recorder = {"/recorder": _common(scenario)} if bag else {}
        file.write_text(scenario.text({"/plant": {"wait_for_recorder": bag is not None}, **recorder}))
        announce(f"ROS_DOMAIN_ID={domain}")
        graph = Graph(domain, Path(directory))
        arguments = ["--params-file", str(file)]
        try:
            if bag:
                graph.start("/recorder", [*arguments, "-p", f"bag:={json.dumps(str(bag))}"])
            plant_process = graph.start("/plant", arguments)
            for deputy in scenario.plant.deputies:
                for process in ("satellite",) if composed else topics.PARTS:
                    graph.start(f"/{deputy}/{process}", arguments)
            if display:
                graph.start("/display", arguments)
            with _listener(domain, hear) as listen:
                while plant_process.process.poll() is None:
                    listen(0.1)
                    raise_if_interrupted()
                    graph.check()
                graph.check()
                end = monotonic() + LAST_WORD
                while last.message != "finished" and monotonic() < end:
                    listen(0.1)
        finally:
            graph.stop()
        for node in graph.nodes:
            if node.name == "/recorder" and node.process.returncode != 0:
                raise NodeDied(f"{node.name} did not close its bag: {node.reason()}")
    return last


def _common(scenario: Scenario) -> dict[str, Any]:
    """What the recorder is told of the common: the same as every node."""
    common = dump(scenario.plant)
    return {name: value for name, value in common.items() if name == "tick" or name.startswith("chief.")}
