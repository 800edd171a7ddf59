"""Processes of a run's node graph: started, watched, and stopped, all of them."""

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

from formation_gnc.errors import ConfigurationError
from formation_gnc.transport.fork_server import ForkedProcess, fork_server

GRACE = 2.0
"""Wall time (s) that nodes have to stop when asked; those left then are killed."""

TIME_TO_CLOSE = 10.0
"""Wall time (s) that the recorder has to close its bag, which takes long on a busy machine."""


RESPAWNS = 5
"""Times that a node is started again; one that dies more often has a reason to."""


class NodeDied(RuntimeError):
    """A node ended before the run; the message says which and why."""


@dataclass
class NodeProcess:
    """A running node."""

    name: str
    process: ForkedProcess
    log: Path
    arguments: list[str]
    respawns: int = 0
    """Times that it may be started again."""

    @property
    def has_died(self) -> bool:
        """Whether it has ended with an error."""
        return self.process.poll() not in (None, 0)

    def reason(self) -> str:
        """Why it ended, in words, with the last line of its log."""
        code = self.process.returncode or 0
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
        self._domain = domain
        self._directory = directory

    def start(self, name: str, arguments: list[str], respawns: int = 0) -> NodeProcess:
        """Start the node of this full name, such as ``/deputy1/controller``, in a session and enclave of its own.

        respawns: times that `respawn` may start it again.
        """
        namespace, _, kind = name.rpartition("/")
        remap = ["-r", f"__ns:={namespace}"] if namespace else []
        log = self._directory / f"{name.strip('/').replace('/', '.')}.log"
        process = fork_server().start(
            executable(kind), ["--ros-args", *remap, "--enclave", name, *arguments], self._environment(), log
        )
        node = NodeProcess(name, process, log, arguments, respawns)
        self.nodes.append(node)
        return node

    def _environment(self) -> dict[str, str]:
        """Variables of a node: those of this process as they are now, which the enclaves of a flight change."""
        reach = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        return reach | os.environ | {"ROS_DOMAIN_ID": str(self._domain)}

    def check(self) -> None:
        """Raise NodeDied if a node has ended with an error, and is not to be started again."""
        for node in self.nodes:
            if node.has_died and not node.respawns:
                raise NodeDied(f"{node.name} ended: {node.reason()}")

    def respawn(self) -> Iterator[str]:
        """Start again what has ended with an error and may be; what ended and why, in words."""
        for node in [each for each in self.nodes if each.respawns and each.has_died]:
            words = f"{node.name} ended: {node.reason()}; started again"  # before the next one writes to the log
            self.nodes.remove(node)
            self.start(node.name, node.arguments, node.respawns - 1)
            yield words

    def stop(self) -> None:
        """Stop every node, the recorder last, after its queues are drained; kill what does not stop."""
        for kind in (False, True):
            group = [node for node in self.nodes if node.name.endswith("/recorder") is kind]
            _signal(group, signal.SIGINT)
            _wait(group, GRACE / 2 if not kind else TIME_TO_CLOSE)
            _signal(group, signal.SIGKILL)
        _wait(self.nodes, GRACE)


def _signal(nodes: list[NodeProcess], number: signal.Signals) -> None:
    for node in nodes:
        if node.process.poll() is None:
            with suppress(ProcessLookupError):  # it has just ended
                os.killpg(node.process.pid, number)


def _wait(nodes: list[NodeProcess], seconds: float) -> None:
    end = monotonic() + seconds
    while monotonic() < end and any(node.process.poll() is None for node in nodes):
        sleep(0.02)
