"""A fleet on the graph: eight deputies in a process each, beside one, on two cores."""

import os
import statistics
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import yaml

from bench.result import Result
from formation_gnc.sil.plant_executive import Report
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import SECTION, Scenario, find_scenario, load_scenario
from formation_gnc.transport.launcher import LaunchOptions, fly_graph

SCENARIO = "projected_circle"
CORES = 2
ROUNDS = 2
DEPUTY_TICKS = 2400
"""Ticks of a flight, all its deputies together: a few seconds for one deputy as for eight."""

FLEETS = {"one deputy": (1, False), "eight, each by itself": (8, False), "eight in touch": (8, True)}
"""How many satellites, and whether they wait for one another's estimates and assign slots."""


@dataclass(frozen=True)
class Flight:
    """What a run on the graph took, from its first report in flight to its end."""

    deputies: int
    speed: float
    """Ticks per second of wall time."""
    plant: float
    """Processor time of the plant per tick, s."""
    satellites: float
    """Processor time of all satellites together per tick, s."""
    arithmetic: float
    """Processor time per tick that plant and satellites take without a graph, s."""
    misses: float

    @property
    def work(self) -> float:
        """Processor time of all processes per tick, s."""
        return self.plant + self.satellites

    @property
    def cores(self) -> float:
        """How many cores it kept busy."""
        return self.speed * self.work


@contextmanager
def some_of(count: int, in_touch: bool) -> Iterator[Scenario]:
    """The scenario with its first deputies only, which may be a fleet with assigned slots."""
    document = yaml.safe_load(find_scenario(SCENARIO).read_text())
    plant, guidance = document["/plant"][SECTION], document["/**/guidance"][SECTION]
    for name in plant["deputies"][count:]:
        del plant[name]
    plant |= {"deputies": plant["deputies"][:count], "duration": DEPUTY_TICKS // count * 1.0}
    if not in_touch:
        guidance |= {"fleet": [], "assignment": "fixed"}
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / f"{SCENARIO}.yaml"
        path.write_text(yaml.safe_dump(document))
        yield load_scenario(str(path))


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Let this process, and who is started by it, run on so many cores at most."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(allowed)[:count])
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def processor_time(name: str) -> float:
    """Processor time (s) until now of this process's children of a name."""
    spent = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            start, _, rest = file.read_text().rpartition(") ")
        except OSError:  # it has ended since
            continue
        fields = rest.split()
        if start.endswith(f"({name}") and int(fields[1]) == os.getpid():
            spent += int(fields[11]) + int(fields[12])  # user and system
    return spent / os.sysconf("SC_CLK_TCK")


def fly(count: int, in_touch: bool) -> Flight:
    """Fly `count` deputies on the graph, a process each, without a recorder."""
    seen: list[tuple[float, ...]] = []

    def look(report: Report) -> None:
        if report.message in ("flying", "finished"):
            times = processor_time("plant"), processor_time("satellite")
            seen.append((report.figures["tick"], report.figures["wall_time"], *times))

    with some_of(count, in_touch) as scenario:
        last = fly_graph(scenario, LaunchOptions(composed=True), look, lambda _: None)
        alone = Run(scenario)
        alone.tick(lambda topic, record: None)  # which assigns the slots
        started = process_time()
        alone.fly(lambda topic, record: None)
        arithmetic = (process_time() - started) / (alone.plant.tick - 1)
    ticks, wall, plant, satellites = (after - before for before, after in zip(seen[0], seen[-1], strict=True))
    return Flight(count, ticks / wall, plant / ticks, satellites / ticks, arithmetic, last.figures["misses"])


def flights() -> dict[str, Flight]:
    """All fleets, flown in turn: means, and all misses."""
    flown: dict[str, list[Flight]] = {name: [] for name in FLEETS}
    with on_cores(CORES):
        for _ in range(ROUNDS):
            for name, fleet in FLEETS.items():
                flown[name].append(fly(*fleet))
    return {
        name: Flight(
            taken[0].deputies,
            *(
                statistics.mean(getattr(each, what) for each in taken)
                for what in ("speed", "plant", "satellites", "arithmetic")
            ),
            sum(each.misses for each in taken),
        )
        for name, taken in flown.items()
    }


def run() -> list[Result]:
    """All figures of the fleet."""
    (_, one), *more = (flown := flights()).items()
    results = []
    for name, each in more:
        for what, ours, theirs, unit in (
            ("", each.deputies * each.speed, one.speed, "deputy ticks/s"),
            (", work of a deputy", 1e3 * each.satellites / each.deputies, 1e3 * one.satellites, "ms a tick"),
            (", work of the plant for it", 1e3 * each.plant / each.deputies, 1e3 * one.plant, "ms a tick"),
            (", cores busy", each.cores, one.cores, ""),
        ):
            results.append(Result(f"{name}, against one{what}", ours, theirs, unit, ours / theirs, ""))
    misses = sum(each.misses for each in flown.values())
    return [*results, Result("ticks missed by one and by eight deputies", misses, 0.0, "", misses, "<= 0")]
