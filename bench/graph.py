"""The lock-step graph beside its floor, the in-process runner, and what recording costs either."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import domain_coordinator

from bench.floor import ROLES
from bench.result import Result, interleaved
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.launcher import LaunchOptions, fly_graph

TICKS = 6000
ROUNDS = 5


def floor(kind: str) -> float:
    """Ticks per second of the do-nothing graph, of messages or of bytes."""
    with domain_coordinator.domain_id() as domain:
        environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}
        commands = [[sys.executable, "-m", "bench.floor", kind, role, str(TICKS)] for role in ROLES]
        relays = [subprocess.Popen(command, env=environment) for command in commands[:-1]]
        try:
            answer = subprocess.run(commands[-1], env=environment, capture_output=True, text=True, check=True)
        finally:
            for relay in relays:
                relay.terminate()
                relay.wait()
    return float(answer.stdout)


def graph(record: bool) -> float:
    """Ticks per second of the graph on the default scenario."""
    scenario = load_scenario("leader_follower", {"/plant": {"duration": float(TICKS)}})
    with tempfile.TemporaryDirectory() as directory:
        bag = Path(directory) / "bag" if record else None
        report = fly_graph(scenario, LaunchOptions(bag), lambda _: None, lambda _: None)
    return report.figures["tick"] / report.figures["wall_time"]


def in_process(record: bool) -> float:
    """Ticks per second of the in-process runner on the default scenario."""
    run = Run(load_scenario("leader_follower", {"/plant": {"duration": float(TICKS)}}))
    if not record:
        started = perf_counter()
        run.fly(lambda topic, record: None)
        return TICKS / (perf_counter() - started)
    with tempfile.TemporaryDirectory() as directory:
        started = perf_counter()
        with BagWriter(Path(directory) / "bag", {}) as bag:
            run.fly(InProcessRecorder(bag))
        return TICKS / (perf_counter() - started)


def run() -> list[Result]:
    """All figures of the graph."""
    bare, bare_bytes, flown, recorded, process, process_recorded = interleaved(
        [
            lambda: floor("messages"),
            lambda: floor("bytes"),
            lambda: graph(False),
            lambda: graph(True),
            lambda: in_process(False),
            lambda: in_process(True),
        ],
        ROUNDS,
    )
    return [
        Result("graph against a do-nothing floor", flown, bare, "ticks/s", flown / bare, ">= 0.7"),
        Result("graph against the floor of bytes alone", flown, bare_bytes, "ticks/s", flown / bare_bytes, ""),
        Result("in-process against real time, 1 s tick", process, 1.0, "ticks/s", process, ">= 5000"),
        Result("graph with recorder against without", recorded, flown, "ticks/s", recorded / flown, ""),
        Result(
            "in-process with recording against without",
            process_recorded,
            process,
            "ticks/s",
            process_recorded / process,
            "",
        ),
        Result("in-process against graph", process, flown, "ticks/s", process / flown, ""),
    ]
