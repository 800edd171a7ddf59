"""A fleet on the graph: eight deputies in a process each, beside one."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import yaml

from bench.result import Result, interleaved
from formation_gnc.nodes.launcher import fly_graph
from formation_gnc.sil.scenario import SECTION, Scenario, find_scenario, load_scenario

TICKS = 1500
ROUNDS = 3
FLEET = 8


@dataclass(frozen=True)
class Flight:
    """What a run on the graph took."""

    speed: float
    """Ticks per second of wall time."""
    work: float
    """Processor time of all processes over their lives, per tick flown, s."""
    misses: float


@contextmanager
def line(count: int, in_touch: bool) -> Iterator[Scenario]:
    """The default scenario with `count` deputies 100 m apart, who may wait for one another's estimates."""
    document = yaml.safe_load(find_scenario("leader_follower").read_text())
    names = [f"deputy{index + 1}" for index in range(count)]
    plant = document["/plant"][SECTION]
    first = plant.pop("deputy1")
    for index, name in enumerate(names):
        x, _, *rest = first["relative_state"]
        plant[name] = first | {"relative_state": [x, -100.0 * (index + 1) + 10.0, *rest]}
        document[f"/{name}/guidance"] = {SECTION: {"slot": index}}
    plant |= {"deputies": names, "duration": float(TICKS)}
    if in_touch:
        document["/**/guidance"][SECTION]["fleet"] = names
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "line.yaml"
        path.write_text(yaml.safe_dump(document))
        yield load_scenario(str(path))


def fly(count: int, in_touch: bool = False, composed: bool = True) -> Flight:
    """Fly `count` deputies on the graph, without a recorder."""
    before = os.times()
    with line(count, in_touch) as scenario:
        figures = fly_graph(scenario, None, lambda _: None, lambda _: None, composed).figures
    after = os.times()
    spent = after.children_user - before.children_user + after.children_system - before.children_system
    return Flight(figures["tick"] / figures["wall_time"], spent / figures["tick"], figures["misses"])


def run() -> list[Result]:
    """All figures of the fleet."""
    flights: dict[str, list[Flight]] = {}

    def speed(name: str, *arguments: object) -> float:
        flight = fly(*arguments)  # type: ignore[arg-type]
        flights.setdefault(name, []).append(flight)
        return flight.speed

    one, apart, eight, in_touch = interleaved(
        [
            lambda: speed("one", 1),
            lambda: speed("apart", 1, False, False),
            lambda: speed("eight", FLEET),
            lambda: speed("in touch", FLEET, True),
        ],
        ROUNDS,
    )
    misses = sum(flight.misses for taken in flights.values() for flight in taken)
    unit = "deputy ticks/s"
    return [
        Result("one deputy: a process against one per node", one, apart, "ticks/s", one / apart, ""),
        Result("eight deputies, composed, against one", FLEET * eight, one, unit, FLEET * eight / one, ""),
        Result("eight in touch, against one", FLEET * in_touch, one, unit, FLEET * in_touch / one, ""),
        Result("ticks missed by one and by eight deputies", misses, 0.0, "", misses, "<= 0"),
    ]
