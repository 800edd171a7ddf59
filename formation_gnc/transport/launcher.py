"""Flies a scenario on the node graph: starts it in a ROS domain of its own, watches it, and stops it."""

import json
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import domain_coordinator
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from formation_gnc.flight.access import LAUNCHER, OPERATOR, SATELLITE, access_by_process
from formation_gnc.flight.graph import DISPLAY, MODULES, PLANT, RECORDER
from formation_gnc.sil.report import Report
from formation_gnc.sil.scenario import Scenario
from formation_gnc.transport.diagnostics import subscribe_to_reports
from formation_gnc.transport.leftovers import folder_prefix, sweep
from formation_gnc.transport.processes import RESPAWNS, Graph, NodeDied, NodeProcess
from formation_gnc.transport.security import OVERRIDE, check_secured, secured, variables

LAST_REPORT = 1.0
"""Wall time (s) after the plant's end in which its last report is awaited."""

LISTEN = 0.1
"""Wall time (s) between checks of the processes."""


@dataclass(frozen=True)
class LaunchOptions:
    """How a scenario is flown.

    bag: directory to record to; None for no recorder. composed: one process for each satellite, not one for
    each of its modules. display: start the display node too. respawn: start a deputy's node again when it has died.
    secure: fly in the enclaves of a keystore, that of this folder, or by default one made for this flight alone.
    """

    bag: Path | None = None
    composed: bool = False
    display: bool = False
    respawn: bool = False
    secure: bool = False
    keystore: Path | None = None


@contextmanager
def _noted_interrupts() -> Iterator[Callable[[], None]]:
    """A function that raises KeyboardInterrupt if SIGINT, SIGTERM or SIGHUP has come.

    Raised by the handler itself it could strike inside rclpy, which sometimes swallows it.
    """
    noted: list[int] = []
    previous = {
        number: signal.signal(number, lambda number, _: noted.append(number))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
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
def _listener(domain: int, callback: Callable[[Report], None]) -> Iterator[Callable[[float], None]]:
    """A function that receives the run's reports for a time (s)."""
    context = Context()
    rclpy.init(args=["--ros-args", "--enclave", LAUNCHER], context=context, domain_id=domain)
    node = rclpy.create_node("sil", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    subscribe_to_reports(node, callback)
    try:
        yield lambda seconds: executor.spin_once(timeout_sec=seconds)
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def fly_graph(
    scenario: Scenario,
    options: LaunchOptions,
    show: Callable[[Report], None],
    announce: Callable[[str], None],
) -> Report:
    """Fly a scenario on the node graph.

    Args:
        scenario: what to fly.
        options: how.
        show: called with the run's reports.
        announce: called with a line that names the ROS domain of the graph, and with one for each node started again.

    Returns:
        The last report of the plant.

    Raises:
        ConfigurationError: a secured flight that this ROS or the keystore does not allow; nothing has been started.
        NodeDied: a node ended before the run did; everything else has been stopped and the bag is closed.
    """
    last = Report("starting", {})

    def receive(report: Report) -> None:
        nonlocal last
        last = report
        show(report)

    sweep()
    with (
        tempfile.TemporaryDirectory(prefix=folder_prefix()) as directory,
        domain_coordinator.domain_id() as domain,
        _noted_interrupts() as raise_if_interrupted,
    ):
        graph = Graph(domain, Path(directory))
        try:
            with _enclaves(scenario, options, Path(directory)) as to_join, _listener(domain, receive) as listen:
                announce(" ".join((f"ROS_DOMAIN_ID={domain}", *to_join)))
                plant = _start(graph, scenario, options, Path(directory))
                while plant.process.poll() is None:
                    listen(LISTEN)
                    raise_if_interrupted()
                    for line in graph.respawn():
                        announce(line)
                    graph.check()
                graph.check()
                end = monotonic() + LAST_REPORT
                while last.message != "finished" and monotonic() < end:
                    listen(LISTEN)
        finally:
            graph.stop()
        for node in graph.nodes:
            if node.name == RECORDER and node.process.returncode != 0:
                raise NodeDied(f"{node.name} did not close its bag: {node.reason()}")
    return last


@contextmanager
def _enclaves(scenario: Scenario, options: LaunchOptions, directory: Path) -> Iterator[list[str]]:
    """Let all that is started fly in enclaves, if it is to; gives the variables by which an operator joins."""
    if not options.secure:
        yield []
        return
    from formation_gnc.transport.keystore import make_keystore

    keystore = options.keystore or directory / "keystore"
    if not options.keystore:
        make_keystore(keystore, access_by_process(scenario.plant.deputies))
    check_secured(keystore, _processes(scenario, options))
    with secured(keystore):
        yield [f"{name}={value}" for name, value in (variables(keystore) | {OVERRIDE: OPERATOR}).items()]


def _processes(scenario: Scenario, options: LaunchOptions) -> list[str]:
    """Full names of all processes of a flight, in the order in which they are started."""
    kinds = (SATELLITE,) if options.composed else MODULES
    modules = [f"/{deputy}/{kind}" for deputy in scenario.plant.deputies for kind in kinds]
    return [*([RECORDER] if options.bag else []), PLANT, *modules, *([DISPLAY] if options.display else [])]


def _start(graph: Graph, scenario: Scenario, options: LaunchOptions, directory: Path) -> NodeProcess:
    """Start every node of a scenario; returns the plant's."""
    file = directory / f"{scenario.name}.yaml"
    extra = {PLANT: {"wait_for_recorder": options.bag is not None}}
    file.write_text(scenario.text(extra))
    arguments = ["--params-file", str(file)]
    own = {RECORDER: ["-p", f"bag:={json.dumps(str(options.bag))}"]}
    for name in _processes(scenario, options):
        is_of_deputy = name not in (RECORDER, PLANT, DISPLAY)
        graph.start(name, [*arguments, *own.get(name, [])], RESPAWNS if options.respawn and is_of_deputy else 0)
    return next(node for node in graph.nodes if node.name == PLANT)
