"""Every law on the scenarios that show laws, on the truth and on estimates: one table, and what of it has moved.

`python -m verification.laws [SCENARIO or LAW ...]` flies what has no figures yet, and the named ones anew, keeps each
flight in `laws.csv` as soon as it is flown, and writes `laws.md` from there: to be done when a change is meant to
change the flights, and what changed to be looked at before it is committed. `python -m verification laws` flies all
and compares.
"""

import csv
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, dataclass, fields
from functools import cache
from itertools import product
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np

from formation_gnc.control.registry import ALGORITHMS, FINITE_HORIZONS
from formation_gnc.errors import DesignError
from formation_gnc.flight.schedule import parse_schedule
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from verification.figure import TABLE, Figure, failures
from verification.omniscient import Omniscient

SCENARIOS = ("eccentric_leo", "geostationary", "leader_follower", "projected_circle", "tetrahedral")
"""One of each kind: eccentric, high, low along-track, and two fleets that are assigned. The other shipped ones are
missions of others with the law that suits them, or faults."""

EXPECTED = Path(__file__).with_name("laws.csv")

TICK = 10.0
"""Tick of all flights, s, unless the scenario's is longer: a tenth of the time, and all laws are as good."""

MOST_TICKS = 9_000
"""Ticks of all deputies together after which a flight is cut off: a day of one satellite. It ends before the target
is changed by schedule, too: what it takes to follow that is in the pages of the seeds and of guidance. The whole table
takes about twenty minutes of one core then."""

LAWS: dict[str, dict[str, dict[str, Any]]] = {
    **{name: {"/**/controller": {"algorithm": name}} for name in ALGORITHMS},
    "lqr, nonlinear feed-forward": {
        "/**/controller": {"algorithm": "lqr", "lqr.feed_forward": "nonlinear"},
        "/**/guidance": {"preview_steps": 1, "preview_step": TICK},
    },
    "hinf, full information": {"/**/controller": {"algorithm": "hinf", "hinf.form": "full_information"}},
}
"""What is changed of a scenario: all algorithms, and some with other parameters."""


class Clocked:
    """Stands where a module does, and notes the compute time of each answer."""

    def __init__(self, module: Any) -> None:
        """Around a module."""
        self._module = module
        self.times: list[float] = []
        self.take_events = module.take_events

    def __getattr__(self, name: str) -> Any:
        """All else of the module."""
        return getattr(self._module, name)

    def on_tick(self, *inputs: Any) -> Any:
        """The module's answer."""
        started = thread_time()
        answer = self._module.on_tick(*inputs)
        self.times.append(thread_time() - started)
        return answer


def name_of(scenario: str, law: str, knows: str) -> str:
    """Which flight it is, in words."""
    return f"{scenario}, {law}, on {knows}"


@dataclass(frozen=True)
class Row:
    """A flight and its figures; of several deputies the largest errors and peak, and the sum of delta-v."""

    scenario: str
    law: str
    knows: str
    final_error: float
    """Distance from the target at the end, m."""
    rms_error: float
    """Root mean square of the same over the last third, m."""
    delta_v: float
    """Sum over the axes, mm/s."""
    peak: float
    """Largest force commanded on an axis, mN."""
    saturated: float
    """Ticks on which the law asked for more than the limit, %."""
    fallback: float
    """Ticks on which not the law's own answer flew, as its status says, %."""
    compute: float
    """Median compute time of the controller in a tick, us."""

    @property
    def name(self) -> str:
        """Which flight it is."""
        return name_of(self.scenario, self.law, self.knows)

    @property
    def line(self) -> str:
        """Line of a Markdown table."""
        figures = [f"{value:.3g}" for value in astuple(self)[3:-1]]
        compute = round(self.compute, 1 - len(str(int(self.compute))))  # a digit, lest no page equals another
        return f"| {self.law} | {self.knows} | " + " | ".join(figures) + f" | {compute:g} |"

    def moved(self, expected: "Row | None") -> list[Figure]:
        """Its figures with the tolerances that follow from those that are expected."""
        figures = []
        for field, (relative, absolute, unit) in TOLERANCES.items():
            ours, least = getattr(self, field), getattr(expected, field, float("nan"))
            margin = relative * least + absolute
            words = field.replace("_", " ")
            figures.append(Figure(f"{self.name}: {words}", f"{least:.4g}", ours, unit, least - margin, least + margin))
        return figures


TOLERANCES = {
    "final_error": (0.02, 0.005, "m"),
    "rms_error": (0.02, 0.005, "m"),
    "delta_v": (0.02, 0.05, "mm/s"),
    "peak": (0.02, 0.01, "mN"),
    "saturated": (0.02, 0.1, "%"),
    "fallback": (0.02, 0.1, "%"),
    "compute": (4.0, 0.0, "us"),
}
"""Relative and absolute: far above what rounding changes, below what a change of a law does; and what
machines differ by."""

HEADING = f"""# All laws

Written by `verification/laws.py`. As `formation-gnc sil SCENARIO --controller LAW` flies them, but on ticks of
{TICK:g} s, and until the first change of target by schedule or {MOST_TICKS} ticks of all deputies together at most;
on the truth in place of estimates, and on estimates. Error of the true position against the target, at the end and
RMS over the last third; delta-v summed over the axes; largest force on an axis; share of ticks on which the law
asked for more than the limit; share of ticks on which its own answer could not be used and a fallback flew, as the
status names it; median compute time of the controller. Of several deputies the largest errors and force, and the
sum of delta-v. `python -m verification laws` holds each to `verification/laws.csv` within 2 % and 5 mm, 0.05 mm/s,
0.01 mN, 0.1 %; five times the compute time.

{", ".join(FINITE_HORIZONS)} have flown to their target before the last
third of each flight. After `final_time` LQR on Hill's equations holds it, which is no fallback: their errors
at the end and over the last third are those of the holding LQR; delta-v and force are of both.
"""

HEAD = (
    "| law | knows | final error, m | RMS, m | delta-v, mm/s | peak, mN | limited, % | fallback, % "
    "| compute, us |\n|---|---|---|---|---|---|---|---|---|"
)


def flights() -> list[tuple[str, str, str]]:
    """Scenario, law and what the law knows, of all flights in the order of the table."""
    designed = [each for each in product(SCENARIOS, LAWS) if not refusal(*each)]
    return [(*each, knows) for each in designed for knows in ("truth", "estimate")]


@cache
def refusal(scenario: str, law: str) -> str:
    """Why a law is not designed for a scenario; empty if it is."""
    try:
        _prepare(scenario, law)
    except DesignError as error:
        return str(error)
    return ""


def _prepare(scenario: str, law: str) -> Run:
    tick = max(TICK, load_scenario(scenario).plant.tick)
    return Run(load_scenario(scenario, {"/**": {"tick": tick}, **LAWS[law]}))


def _length(run: Run) -> int:
    """Ticks that a flight is followed for."""
    plant = run.plant.parameters
    guidance = [run.instances[f"/{name}/guidance"].module.parameters for name in plant.deputies]
    changes = [change.time // plant.tick_ns for each in guidance for change in parse_schedule(each.schedule)]
    return min(plant.ticks, MOST_TICKS // len(plant.deputies), *changes)


def fly(scenario: str, law: str, knows: str) -> Row:
    """One flight."""
    run = _prepare(scenario, law)
    tick = run.plant.parameters.tick
    clocks = []
    for name in run.plant.parameters.deputies:
        if knows == "truth":
            run.instances[f"/{name}/navigation"].module = Omniscient(run.plant, name)
        controller = run.instances[f"/{name}/controller"]
        clocks.append(Clocked(controller.module))
        controller.module = clocks[-1]
    records: dict[str, list[Any]] = {}

    def sink(topic: str, record: Any) -> None:
        records.setdefault(topic, []).append(record)

    names = run.plant.parameters.deputies
    for _ in range(_length(run)):
        run.tick(sink)
    if run.misses:
        raise RuntimeError(f"{scenario}, {law}: {run.misses} ticks missed")
    errors, forces, masses, limited, failed = [], [], [], [], []
    for index, name in enumerate(names):
        aims = np.array([target.relative_state for target in records[f"/{name}/target"]])
        true = [truth.deputies[index] for truth in records["/truth"]]
        errors.append(np.linalg.norm((np.array([each.relative_state for each in true]) - aims)[:, :3], axis=1))
        forces.append([thrust.force for thrust in records[f"/{name}/thrust"]])
        masses.append([each.mass for each in true])
        limited.append([any(status.saturated) for status in records[f"/{name}/status"]])
        failed.append([bool(status.fallback) for status in records[f"/{name}/status"]])
    error, force = np.array(errors), np.abs(forces)
    last = error[:, -(error.shape[1] // 3) :]
    return Row(
        scenario,
        law,
        knows,
        float(error[:, -1].max()),
        float(np.sqrt(np.mean(last**2, axis=1)).max()),
        1e3 * tick * float((force.sum(axis=2) / masses).sum()),
        1e3 * float(force.max()),
        100.0 * float(np.mean(limited)),
        100.0 * float(np.mean(failed)),
        1e6 * float(np.median(np.concatenate([clock.times for clock in clocks]))),
    )


def fly_all(chosen: Sequence[tuple[str, str, str]]) -> list[Row]:
    """The flights, on all cores; compute times are of the thread, which no neighbour lengthens much."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(fly, *zip(*chosen, strict=True))) if chosen else []


def expected() -> dict[str, Row]:
    """What was flown when the figures were last accepted, by name; NaN where there was no such column."""
    with EXPECTED.open() as stream:
        kept = [
            Row(
                row["scenario"],
                row["law"],
                row["knows"],
                **{field: float(row.get(field, "nan")) for field in TOLERANCES},
            )
            for row in csv.DictReader(stream)
        ]
    return {row.name: row for row in kept}


def page(rows: Sequence[Row], figures: Sequence[Figure] = ()) -> str:
    """The table, and which of the figures are not as expected."""
    lines = [HEADING]
    for scenario in SCENARIOS:
        lines += [f"## {scenario}", "", HEAD, *(row.line for row in rows if row.scenario == scenario), ""]
        flown = {row.law for row in rows if row.scenario == scenario}
        reasons = {law: refusal(scenario, law) for law in LAWS if law not in flown}
        lines += [f"Refused: {reason}.\n" for reason in reasons.values() if reason]
        left = "; ".join(law for law, reason in reasons.items() if not reason)
        lines += [f"Not flown yet: {left}.\n"] if left else []
    outside = [figure.row for figure in figures if not figure.holds]
    if outside:
        lines += ["Moved:", "", TABLE.replace("printed", "expected"), *outside, ""]
    return "\n".join(lines)


def main(directory: Path) -> int:
    """Fly all and write the page; return how many figures have moved."""
    rows, before = fly_all(flights()), expected()
    figures = [figure for row in rows for figure in row.moved(before.get(row.name))]
    (directory / "laws.md").write_text(page(rows, figures))
    return failures(figures)


def accept(names: list[str], directory: Path) -> None:
    """Keep what flies now of the named scenarios and laws, and of those that have no figures; write the page."""
    rows = {row.name: row for row in expected().values() if not {row.scenario, row.law} & {*names}}
    for flight in flights():
        if name_of(*flight) not in rows:
            row = fly(*flight)
            rows[row.name] = row
            print(row.line, flush=True)
            _keep(rows)
    (directory / "laws.md").write_text(page(_keep(rows)))


def _keep(rows: dict[str, Row]) -> list[Row]:
    """Write the figures of those flights that there are, in the order of the table."""
    kept = [rows[name_of(*flight)] for flight in flights() if name_of(*flight) in rows]
    with EXPECTED.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in fields(Row)])
        writer.writerows(
            [value if isinstance(value, str) else f"{value:.6g}" for value in astuple(row)] for row in kept
        )
    return kept


if __name__ == "__main__":
    accept(sys.argv[1:], Path("docs/verification"))
