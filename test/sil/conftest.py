"""Real node processes for software-in-the-loop tests, started as a user starts them."""

import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import domain_coordinator
import pytest

from formation_gnc.cli import main
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.graph import MODULES
from formation_gnc.recording import Bag
from formation_gnc.sil.scenario import find_scenario
from formation_gnc.transport.fork_server import ForkedProcess, fork_server
from formation_gnc.transport.parameter_client import set_parameters
from formation_gnc.transport.processes import executable

GNC_TOPICS = (
    "/clock",
    "/truth",
    *(f"/deputy1/{topic}" for topic in ("measurement", "estimate", "target", "thrust", "status", "mode")),
)
PARTS = tuple(MODULES)
PATIENCE = 90.0  # s of wall time, for a machine that is busy with other things
DEADLINE = 60.0  # s of wall time for an answer, on such a machine; a test of misses has its own
MISSED = 3.0  # s, that own one: for a node that has been killed

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # what is aborted to hear where it was leaves nothing else


def wait_until(condition: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    """Wait for something to become true, or fail the test saying what did not."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, f"not within {patience:g} s: {what}"
        time.sleep(0.05)


def has_messages(bag: Path, topic: str, more_than: int = 0) -> bool:
    """Whether messages of a topic are on disk."""
    try:
        return Bag(bag).topics[topic].count > more_than
    except (ConfigurationError, KeyError):  # not made yet, or not yet heard of
        return False


def set_parameter(domain: int, node: str, name: str, value: Any) -> tuple[bool, str]:
    """Set a parameter as `formation-gnc set` does: whether it was accepted, and if not, why."""
    try:
        set_parameters(node, {name: value}, domain, PATIENCE)
    except ConfigurationError as rejection:
        return False, str(rejection)
    return True, ""


def answers_again(bag: Path, topic: str) -> bool:
    """Whether a restarted node's messages are on disk."""
    return bool(Bag(bag).restarts([topic])[topic])


class Terminal:
    """A node started by itself, with what it printed.

    by_hand: with its executable, as `ros2 run` starts it, which takes seconds of processor time; by default as
    `formation-gnc sil` starts it.
    """

    def __init__(
        self, kind: str, arguments: list[str], environment: dict[str, str], directory: Path, by_hand: bool = False
    ) -> None:
        self.log = directory / f"{kind}-{time.monotonic_ns()}.log"
        arguments = ["--ros-args", *arguments]
        self.process: subprocess.Popen[bytes] | ForkedProcess
        if not by_hand:
            self.process = fork_server().start(executable(kind), arguments, environment, self.log)
            return
        ros2 = shutil.which("ros2")
        command = [ros2, "run", "formation_gnc", kind] if ros2 else [str(executable(kind))]
        with self.log.open("wb") as stream:
            self.process = subprocess.Popen(
                [*command, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # ros2 run does not pass signals on: the group gets them
            )

    @property
    def text(self) -> str:
        return self.log.read_text(errors="replace")

    def signal(self, number: signal.Signals) -> None:
        os.killpg(self.process.pid, number)

    def wait(self, patience: float = PATIENCE) -> int:
        wait_until(lambda: self.process.poll() is not None, f"the end of {self.log.stem}", patience)
        assert self.process.returncode is not None
        return self.process.returncode


class Desk:
    """A desk with several terminals, all in one ROS domain of its own."""

    def __init__(self, directory: Path, domain: int) -> None:
        self.directory = directory
        self.domain = domain
        self.environment = os.environ | {"ROS_DOMAIN_ID": str(domain), "PYTHONFAULTHANDLER": "1"}
        self.parameters = find_scenario("leader_follower")
        self.terminals: list[Terminal] = []

    def start(self, kind: str, by_hand: bool = False, **parameters: object) -> Terminal:
        arguments = ["--params-file", str(self.parameters)]
        if kind == "plant":
            parameters = {"deadline": DEADLINE, **parameters}
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={str(value).lower() if isinstance(value, bool) else value}"]
        terminal = Terminal(kind, arguments, self.environment, self.directory, by_hand)
        self.terminals.append(terminal)
        return terminal

    def take_off(self, duration: float = 900.0) -> tuple[Terminal, dict[str, Terminal]]:
        """A flight that is recorded to `bag` and goes on while nodes are killed: the plant and the parts."""
        self.start("recorder", bag=self.directory / "bag")
        plant = self.start("plant", duration=duration, real_time_factor=100.0, deadline=MISSED, wait_for_recorder=True)
        terminals = {kind: self.start(kind) for kind in PARTS}
        wait_until(lambda: "acquired" in terminals["navigation"].text, "the first estimate")
        return plant, terminals

    def land(self) -> None:
        """Ask everybody to stop, and wait until they have."""
        for terminal in self.terminals:
            if terminal.process.poll() is None:
                terminal.signal(signal.SIGINT)
        wait_until(lambda: all(each.process.poll() is not None for each in self.terminals), "the end")

    def clear(self) -> None:
        """Leave nobody behind, and print what everybody said, which is shown if the test failed."""
        for terminal in self.terminals:
            if terminal.process.poll() is None:
                terminal.signal(signal.SIGABRT)  # Python says where it was
                terminal.wait()
            print(f"--- {terminal.log.stem}\n{terminal.text}")


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    with domain_coordinator.domain_id() as domain:
        desk = Desk(tmp_path, domain)
        yield desk
        desk.clear()


@pytest.fixture
def fly(tmp_path: Path, without_pictures: None) -> Callable[..., Bag]:
    """Flights by `formation-gnc sil` from this process, of nodes that are processes; the bag of each."""

    def fly(*arguments: str, directory: Path = tmp_path, scenario: str = "leader_follower") -> Bag:
        bag = directory / "bag"
        flags = ["--bag", str(bag), "--set", f"plant.deadline={DEADLINE}"]
        assert main(["sil", scenario, *flags, *arguments]) == 0
        return Bag(bag)

    return fly


class Sil:
    """A running `formation-gnc sil`."""

    def __init__(self, directory: Path, scenario: str, *arguments: str) -> None:
        self.bag = directory / "bag"
        self.process = subprocess.Popen(
            [
                "formation-gnc",
                "sil",
                scenario,
                "--bag",
                str(self.bag),
                "--set",
                f"plant.deadline={DEADLINE}",
                *arguments,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=directory,
            start_new_session=True,
        )

    def children(self) -> dict[str, int]:
        """Process numbers of the nodes by executable name."""
        listed = subprocess.run(["ps", "-wweo", "pid=,ppid=,args="], capture_output=True, text=True, check=False).stdout
        processes = [line.split() for line in listed.splitlines()]
        servers = {pid for pid, parent, *_ in processes if parent == str(self.process.pid)}
        return {
            Path(word).name: int(pid)
            for pid, parent, *words in processes
            if parent in servers
            for word in words
            if "/lib/formation_gnc/" in word
        }

    def is_recorded(self) -> bool:
        """Whether messages of the flight are on disk."""
        return has_messages(self.bag, "/truth")

    def wait_for_flight(self) -> None:
        """Until the flight is being recorded."""
        wait_until(lambda: self.is_recorded() or self.process.poll() is not None, "the flight to be recorded")
        assert self.process.poll() is None, self.process.stderr.read() if self.process.stderr else ""

    def finish(self, patience: float = PATIENCE) -> tuple[int, str, str]:
        output, errors = self.process.communicate(timeout=patience)
        return self.process.returncode, output, errors


@pytest.fixture
def sil(tmp_path: Path) -> Iterator[Callable[..., Sil]]:
    started: list[Sil] = []

    def start(*arguments: str, directory: Path = tmp_path, scenario: str = "leader_follower") -> Sil:
        directory.mkdir(exist_ok=True)
        started.append(Sil(directory, scenario, *arguments))
        return started[-1]

    yield start
    for each in started:
        for pid in [*each.children().values(), each.process.pid]:
            with suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)
        print(*filter(None, each.process.communicate()), sep="\n")
