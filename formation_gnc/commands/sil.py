"""Fly a scenario in software-in-the-loop, record it and print how well it flew.

The node graph runs as real processes over DDS in a ROS domain of its own; with --in-process the same
objects run in this process, to the same bits and faster. Exit status 3 means that the formation is lost, 4 that
a satellite has given it up: its supervisor had it leave the target, for a mode that is safe.
"""

import argparse
import dataclasses
import json
import os
import sys
import webbrowser
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from textwrap import fill
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from formation_gnc.commands.ros import need_ros
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError
from formation_gnc.sil.overrides import overrides_of
from formation_gnc.sil.preflight import warnings
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, duration_of, load_scenario

if TYPE_CHECKING:
    from formation_gnc.analysis.figures import RunFigures
    from formation_gnc.analysis.run_history import RunHistory
    from formation_gnc.recording.reader import Bag

LOST_STATUS = 3
"""Exit status of a run whose formation is lost."""

GIVEN_UP_STATUS = 4
"""Exit status of a run in which a satellite has given the formation up, and none has lost it."""

PATIENCE = 3.0
"""Wall time (s) between lines about what the run waits for."""

COLUMNS = 2
"""Deputies beyond which the summary has a row, not a column, for each."""

HEADING = 10
"""Characters of a line of the headings over such rows."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("scenario", help="name of a scenario in params/, or a ROS 2 parameter file")
    parser.add_argument("--controller", metavar="NAME", help=f"control law of every deputy: {', '.join(ALGORITHMS)}")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--duration", metavar="S", type=float, help="simulated seconds to fly")
    length.add_argument("--orbits", metavar="N", type=float, help="orbits of the chief to fly")
    parser.add_argument("--seed", metavar="N", type=int, help="seed of every random number of the run")
    parser.add_argument(
        "--real-time-factor",
        metavar="X",
        type=float,
        help="simulated seconds per wall second at most; 0: no limit",
    )
    parser.add_argument(
        "--set",
        metavar="NODE.PARAMETER=VALUE",
        action="append",
        default=[],
        help="any parameter of a node, as controller.algorithm=mpc or plant.deputy1.mass=80; repeatable",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--in-process", action="store_true", help="fly in this process, without the node graph")
    where.add_argument(
        "--composed", action="store_true", help="one process for each satellite, not for each of its nodes"
    )
    parser.add_argument(
        "--bag", metavar="DIR", type=Path, help="directory to make for the bag (default: bags/SCENARIO_DATE)"
    )
    parser.add_argument(
        "--display", action="store_true", help="draw the run as markers and transforms, for RViz or Foxglove"
    )
    parser.add_argument(
        "--page",
        action="store_true",
        help="replay the run, write its page, which tells whether that gave the same bits, and on a desktop open it",
    )
    parser.add_argument(
        "--secure", action="store_true", help="fly in enclaves, with keys made for this flight alone; not without"
    )
    parser.add_argument(
        "--keystore",
        metavar="DIR",
        type=Path,
        help="fly in the enclaves of `formation-gnc keystore`, in this directory",
    )
    parser.add_argument("--respawn", action="store_true", help="start a deputy's node again when it has died")
    parser.add_argument(
        "--accept-lost", action="store_true", help="exit with status 0 also when the formation is lost or given up"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Fly, record, summarise."""
    return fly(_scenario(options), options)


def fly(scenario: Scenario, options: argparse.Namespace) -> int:
    """Fly a scenario, record and summarise it, with the options of this command."""
    bag = options.bag or _free_directory(scenario.name)
    if bag.exists():
        raise ConfigurationError(f"bag {bag}: exists already; name a directory that does not")
    if not options.in_process:
        need_ros("--in-process flies without")
        from formation_gnc.transport.fork_server import fork_server

        fork_server()  # imports while this process looks at the scenario
    console = Console(stderr=True, highlight=False)
    for warning in warnings(scenario):
        console.print(f"warning: {warning}", soft_wrap=True)
    secure = options.secure or options.keystore is not None
    if secure and options.in_process:
        raise ConfigurationError("--secure: is of the node graph alone; with --in-process there is no bus to secure")
    names = ("composed", "display", "respawn", "keystore")
    on_graph = partial(_fly_on_graph, how={name: getattr(options, name) for name in names} | {"secure": secure})
    try:
        speedup = (_fly_in_process if options.in_process else on_graph)(scenario, bag, console)
    except KeyboardInterrupt:
        print(f"formation-gnc: interrupted; {_closed(bag)}", file=sys.stderr)
        return 130
    except RuntimeError as failure:
        print(f"formation-gnc: {failure}; {_closed(bag)}", file=sys.stderr)
        return 1
    return _summarise(scenario, bag, speedup, options)


def _scenario(options: argparse.Namespace) -> Scenario:
    given = {"seed": options.seed, "duration": options.duration, "real_time_factor": options.real_time_factor}
    plant = {name: value for name, value in given.items() if value is not None}
    controller = {"algorithm": options.controller} if options.controller is not None else {}
    overrides: dict[str, dict[str, Any]] = {"/plant": plant, "/**/controller": controller}
    for node, values in overrides_of(options.set).items():
        overrides[node] = overrides.get(node, {}) | values
    scenario = load_scenario(options.scenario, overrides)
    if options.orbits is not None:
        overrides["/plant"]["duration"] = duration_of(options.orbits, scenario)
        scenario = load_scenario(options.scenario, overrides)
    return scenario


def _free_directory(name: str) -> Path:
    first = Path("bags") / f"{name}_{datetime.now(UTC):%Y-%m-%d_%H-%M-%S}"
    directory, number = first, 1
    while directory.exists():
        number += 1
        directory = first.with_name(f"{first.name}-{number}")
    return directory


def _closed(bag: Path) -> str:
    from formation_gnc.recording.reader import Bag

    if not (bag / "metadata.yaml").exists():
        return "nothing was recorded"
    return f"bag cut short, to be recovered: {bag}" if Bag(bag).damage else f"bag closed: {bag}"


class _Display:
    """A progress bar on a terminal; elsewhere a line whenever the state of the run changes."""

    def __init__(self, console: Console, ticks: int) -> None:
        self._console = console
        self._said = ""
        self._said_at = monotonic()
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("ticks, {task.fields[speedup]:,.0f} x real time"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting", total=ticks, speedup=0.0)

    def __enter__(self) -> "_Display":
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def say(self, text: str) -> None:
        if text != self._said:
            self._console.print(text)
            self._said, self._said_at = text, monotonic()

    def show(self, message: str, tick: float, speedup: float) -> None:
        self._bar.update(self._task, description=message, completed=tick, speedup=speedup)
        if message.startswith("waiting") and monotonic() - self._said_at > PATIENCE:
            self.say(message)


def _fly_on_graph(scenario: Scenario, bag: Path, console: Console, how: dict[str, Any]) -> float:
    from formation_gnc.sil.report import Report
    from formation_gnc.transport.launcher import LaunchOptions, fly_graph

    Run(scenario)  # what cannot be flown is rejected before anything starts

    def show(report: Report) -> None:
        shown.show(report.message, report.figures.get("tick", 0.0), report.figures.get("speedup", 0.0))

    with _Display(console, scenario.plant.ticks) as shown:
        options = LaunchOptions(bag.absolute(), **how)
        last = fly_graph(scenario, options, show, shown.say)
        return last.figures.get("speedup", 0.0)


def _fly_in_process(scenario: Scenario, bag: Path, console: Console) -> float:
    from formation_gnc.sil.recorded_flight import fly as fly_in_process

    started = 0.0

    def speedup(ticks: int) -> float:
        return ticks * scenario.plant.tick / (perf_counter() - started)

    def show(ticks: int) -> None:
        nonlocal started
        started = started or perf_counter()
        display.show("flying", ticks, speedup(ticks))

    with _Display(console, scenario.plant.ticks) as display:
        fly_in_process(scenario, bag, show)
        return speedup(scenario.plant.ticks)


def _summarise(scenario: Scenario, bag: Path, speedup: float, options: argparse.Namespace) -> int:
    from formation_gnc.analysis.fault_figures import fault_figures
    from formation_gnc.analysis.figures import figures
    from formation_gnc.analysis.overview import draw_overview
    from formation_gnc.analysis.run_history import RunHistory
    from formation_gnc.analysis.separation import predicted_approach
    from formation_gnc.analysis.verdict import Verdict
    from formation_gnc.recording.reader import Bag

    recorded = Bag(bag).runs()[-1]
    result, flown = figures(recorded), RunHistory(recorded)
    separations = {
        "minimum separation": flown.nearest,
        "least predicted on target": predicted_approach(recorded, "planned"),
        "least predicted without thrust": predicted_approach(recorded, "passive"),
    }
    picture = draw_overview(flown, bag / "overview.png", scenario.name)
    page = _page(recorded, flown, bag / "report.html", scenario.name) if options.page else None
    statuses = {Verdict.LOST: LOST_STATUS, Verdict.GIVEN_UP: GIVEN_UP_STATUS}
    status = 0 if options.accept_lost else statuses.get(result.verdict, 0)
    faults = fault_figures(flown)
    if options.json:
        summary = {
            "scenario": scenario.name,
            "seed": scenario.plant.seed,
            "verdict": result.verdict,
            "ticks": result.ticks,
            "misses": result.misses,
            "speedup": speedup,
            "lost": recorded.lost,
            "bag": str(bag),
            "picture": str(picture),
            "faults": faults,
            "deputies": {name: dataclasses.asdict(each) for name, each in result.deputies.items()},
        }
        if page is not None:
            summary["page"] = str(page)
        names = ("minimum_separation_m", "planned_separation_m", "passive_separation_m")
        for name, each in zip(names, separations.values(), strict=True):
            if each is not None:
                summary[name] = each.distance
        print(json.dumps(summary, indent=2))
        return status
    console = Console(highlight=False)
    _print_figures(console, f"{scenario.name}, seed {scenario.plant.seed}", result)
    lost = f", {recorded.lost} messages not recorded" if recorded.lost else ""
    console.print(f"{result.ticks} ticks, {result.misses} missed{lost}, {speedup:,.0f} x real time")
    worst = [name for name, each in result.deputies.items() if each.verdict is result.verdict]
    console.print(f"formation {result.verdict}" + (f": {', '.join(worst)}" if result.verdict in statuses else ""))
    for name, words in faults.items():
        console.print(f"{name}: modes {' - '.join(words['modes']) or 'unknown'}", soft_wrap=True)
        for key in ("injected", "detected", "answered"):
            for line in words[key]:
                console.print(f"  {key} {line}", soft_wrap=True)
    for label, separation in separations.items():
        if separation is not None:
            pair = " and ".join(separation.pair)
            console.print(f"{label}: {separation.distance:.1f} m, {pair} at {separation.time:.0f} s")
    console.print(f"bag: {bag}\npicture: {picture}" + (f"\npage: {page}" if page else ""), soft_wrap=True)
    return status


def _page(bag: "Bag", flown: "RunHistory", path: Path, title: str) -> Path:
    from formation_gnc.commands.report import write_page_of

    open_page(write_page_of(bag, flown, path, title, replayed=True))
    return path


def open_page(path: Path) -> None:
    """Open a page in the browser, where there is a desktop and somebody who sees it."""
    if sys.stdout.isatty() and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        webbrowser.open(path.absolute().as_uri())


def _print_figures(console: Console, title: str, result: "RunFigures") -> None:
    """Figures by deputy: a column for each deputy, or of a fleet a row."""
    from formation_gnc.analysis.figure_table import FIGURES
    from formation_gnc.commands.tables import print_table

    by_deputy = {name: each.shown() for name, each in result.deputies.items()}
    if len(by_deputy) > COLUMNS:
        columns = [["deputy", *by_deputy]]
        for figure in FIGURES:
            columns.append(
                [
                    fill(figure.label, HEADING, break_long_words=False),
                    *(figure.text(values[figure.name]) for values in by_deputy.values()),
                ]
            )
    else:
        columns = [["figure", *(figure.label for figure in FIGURES)]]
        for name, values in by_deputy.items():
            columns.append([name, *(figure.text(values[figure.name]) for figure in FIGURES)])
    print_table(console, columns, title)
