"""Faults with and without supervision: found when, isolated how, and where the flight ends.

`python -m verification.faults [LAW ...]` flies the named laws, or LQR, and writes docs/verification/faults.md.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import product
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from formation_gnc.mode_records import HealthReport, Mode, ModeState
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import Estimate, Event, Measurement
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.supervision.monitor import Level
from formation_gnc.types import Matrix, Vector
from verification.figure import Figure

VICTIM = "deputy1"

HARM, HELD, COAST, STEP = 20.0, 5.0, 86400.0, 60.0
"""Harm and kept: errors from which and up to which, m; time of coasting after the flight, and its step, s."""


@dataclass(frozen=True)
class Formation:
    """What is flown."""

    onset: int
    """Tick at which the fault begins, after the acquisition."""
    ticks: int
    planned: float
    """Least distance of the targets, m."""
    limit: float
    """Least distance that is safe, m: the tube, as no `least_separation` is set."""
    about_a_satellite: bool
    """Whether the chief is one."""


FORMATIONS = {
    "leader_follower": Formation(6005, 17403, 100.0, 10.0, True),
    "tetrahedral": Formation(4005, 8800, 0.0, 10.0, False),
}


@dataclass(frozen=True)
class Fault:
    """A fault and what is to be named."""

    words: str
    fields: str = ""
    """Of the plant's fault; empty for one of the estimate."""
    subjects: tuple[str, ...] = ("",)
    """Whom to accuse: any of these."""
    offset: Vector | None = None
    """Of the estimated position, m."""
    frozen: bool = False
    """Whether the estimate is."""


EVERY = "radius", "range_rate", "latitude"
AXES = "x", "y", "z"

FAULTS = (
    Fault("radius frozen", "fault: freeze, sensor: radius", ("radius",)),
    Fault("range rate frozen", "fault: freeze, sensor: range_rate", ("range_rate",)),
    Fault("latitude frozen", "fault: freeze, sensor: latitude", ("latitude",)),
    Fault("radius dead", "fault: dropout, sensor: radius", ("radius",)),
    Fault("range rate dead", "fault: dropout, sensor: range_rate", ("range_rate",)),
    Fault("latitude dead", "fault: dropout, sensor: latitude", ("latitude",)),
    Fault("radius biased by 20 m", "fault: bias, sensor: radius, value: 20.0", ("radius",)),
    Fault("radius biased by 100 m", "fault: bias, sensor: radius, value: 100.0", ("radius",)),
    Fault("radius drifting by 1 cm/s", "fault: drift, sensor: radius, rate: 0.01", ("radius",)),
    Fault("radius drifting by 10 cm/s", "fault: drift, sensor: radius, rate: 0.1", ("radius",)),
    Fault("range rate biased by 5 cm/s", "fault: bias, sensor: range_rate, value: 0.05", ("range_rate",)),
    Fault("latitude drifting by 1e-8 rad/s", "fault: drift, sensor: latitude, rate: 1.0e-8", ("latitude",)),
    Fault("latitude biased by 1e-5 rad", "fault: bias, sensor: latitude, value: 1.0e-5", ("latitude",)),
    Fault("radius scaled by 1.00001", "fault: scale, sensor: radius, factor: 1.00001", ("radius",)),
    Fault("radius with five times the noise", "fault: noise, sensor: radius, factor: 5.0", ("", "radius")),
    Fault("a fifth of the radii outliers", "fault: outliers, sensor: radius, share: 0.2", ("", "radius")),
    Fault("radius and latitude swapped", "fault: swap, sensor: radius, other: latitude", ("radius", "latitude")),
    Fault("range rate 20 s late, untold", "fault: late, sensor: range_rate, delay: 20.0, told: false", ("range_rate",)),
    Fault("chief's ephemeris frozen", "fault: chief_freeze"),
    Fault("chief's ephemeris drifting by 5 cm/s", "fault: chief_drift, rate: [0.0, 0.05, 0.0]"),
    Fault("chief's ephemeris drifting by 1 m/s", "fault: chief_drift, rate: [0.0, 1.0, 0.0]"),
    Fault("chief's ephemeris off by 100 m", "fault: chief_jump, offset: [0.0, 100.0, 0.0]"),
    Fault("mass told tenfold", "fault: mass_scale, factor: 10.0"),
    Fault("mass told as a hundredth", "fault: mass_scale, factor: 0.01"),
    Fault("y stuck on, told", "fault: stuck_on, axes: [false, true, false], force: [0.0, {limit}, 0.0]", ("y",)),
    Fault(
        "y stuck on, untold",
        "fault: stuck_on, axes: [false, true, false], force: [0.0, {limit}, 0.0], told: false",
        ("y",),
    ),
    Fault("x stuck off", "fault: stuck_off, axes: [true, false, false]", ("x",)),
    Fault("y stuck off", "fault: stuck_off, axes: [false, true, false]", ("y",)),
    Fault("all thrust halved, told", "fault: thrust_scale, factor: [0.5, 0.5, 0.5]", AXES),
    Fault("thrust reversed, told", "fault: thrust_scale, factor: [-1.0, -1.0, -1.0]", AXES),
    Fault("thrust reversed, untold", "fault: thrust_scale, factor: [-1.0, -1.0, -1.0], told: false", AXES),
    Fault("leak of a twentieth of the limit, untold", "fault: leak, force: [0.0, {leak}, 0.0], told: false", ("y",)),
    Fault("force told frozen", "fault: force_freeze", AXES),
    Fault("force told as none", "fault: force_zero", AXES),
    Fault("estimate off by 100 m along the track", offset=np.array([0.0, 100.0, 0.0])),
    Fault("estimate off by 1 km along the track", offset=np.array([0.0, 1000.0, 0.0])),
    Fault("estimate frozen", frozen=True),
)


class Misled:
    """Stands where the navigation does, and gives estimates that are off, or always the same, from a tick on."""

    def __init__(self, module: Any, onset: int, fault: Fault) -> None:
        """Around a module."""
        self._module, self._onset, self._fault = module, onset, fault
        self._kept: Estimate | None = None

    def __getattr__(self, name: str) -> Any:
        """All else of the module."""
        return getattr(self._module, name)

    def on_tick(self, measurement: Measurement, mode: ModeState | None = None) -> Estimate | None:
        """The module's answer, altered."""
        estimate: Estimate | None = self._module.on_tick(measurement, mode)
        if estimate is None or measurement.time < self._onset:
            self._kept = estimate
            return estimate
        if self._fault.frozen and self._kept is not None:
            return replace(estimate, relative_state=self._kept.relative_state)
        offset = np.zeros(3) if self._fault.offset is None else self._fault.offset
        return replace(estimate, relative_state=estimate.relative_state + np.concatenate([offset, np.zeros(3)]))


@dataclass
class Flight:
    """What came of a flight after the onset."""

    error: list[float] = field(default_factory=list)
    """Of the victim's true position against its target, m, by tick."""
    nearest: float = inf
    """Of any two satellites, m."""
    delta_v: float = 0.0
    """Of the victim, m/s."""
    found: dict[tuple[str, str], int] = field(default_factory=dict)
    """Ticks to the first failure by monitor and subject."""
    answers: list[str] = field(default_factory=list)
    mode: str = ""
    reason: str = ""
    coasting: float = inf
    """Least distance over a day of coasting from the end, m."""
    planned: float = inf
    """Least distance of the targets, m."""

    @property
    def delay(self) -> int | None:
        """Ticks to the first failure of any monitor."""
        return min(self.found.values(), default=None)

    @property
    def first(self) -> str:
        """The monitor that failed first, with its subject."""
        return " ".join(min(self.found, key=self.found.__getitem__)).strip() if self.found else "none"


def fly(formation: str, law: str, fault: Fault, supervised: bool) -> Flight:
    """One flight."""
    given = FORMATIONS[formation]
    limit = load_scenario(formation).plant.deputy[VICTIM].thrusters.limit[1]
    fields = fault.fields.replace("{limit}", f"{limit}").replace("{leak}", f"{limit / 20.0}")
    faults = [f"{{at: {given.onset}.0, deputy: {VICTIM}, {fields}}}"] if fields else []
    overrides: dict[str, dict[str, Any]] = {
        "/plant": {"faults": faults},
        "/**/controller": {"algorithm": law},
        "/**/supervisor": {"enabled": supervised},
    }
    run = Run(load_scenario(formation, overrides))
    if not fields:
        instance = run.instances[f"/{VICTIM}/navigation"]
        instance.module = Misled(instance.module, given.onset * run.plant.parameters.tick_ns, fault)
    flight, records = Flight(), dict[str, Any]()

    def sink(topic: str, record: Any) -> None:
        if isinstance(record, Event):
            return
        records[topic] = record

    tick = run.plant.parameters.tick
    for number in range(given.ticks):
        records.clear()
        run.tick(sink)
        if number >= given.onset:
            _note(flight, records, number - given.onset, run.plant.parameters.deputies, given.about_a_satellite, tick)
    if flight.mode != Mode.KEEP:
        flight.coasting = _coasting(run, given.about_a_satellite)
    return flight


def _note(
    flight: Flight, records: dict[str, Any], tick: int, deputies: Sequence[str], about_a_satellite: bool, step: float
) -> None:
    truth = records["/truth"]
    states = np.array([each.relative_state[:3] for each in truth.deputies])
    targets = [records.get(f"/{name}/target") for name in deputies]
    if targets[0] is not None:
        flight.error.append(float(np.linalg.norm(states[0] - targets[0].relative_state[:3])))
    flight.nearest = min(flight.nearest, _nearest(states, about_a_satellite))
    if all(each is not None for each in targets):
        aims = np.array([each.relative_state[:3] for each in targets])
        flight.planned = min(flight.planned, _nearest(aims, about_a_satellite))
    flight.delta_v += step * float(np.abs(truth.deputies[0].applied_force).sum()) / truth.deputies[0].mass
    health: HealthReport | None = records.get(f"/{VICTIM}/health")
    for each in health.statuses if health else ():
        if each.level == Level.FAILED:
            flight.found.setdefault((each.monitor, each.subject), tick)
    mode: ModeState = records[f"/{VICTIM}/mode"]
    flight.mode, flight.reason = mode.mode, mode.reason
    for each in mode.restrictions:
        if (words := f"{each.kind} {each.subject}") not in flight.answers:
            flight.answers.append(words)
    if mode.mode in (Mode.SAFE, Mode.AVOID) and mode.mode not in flight.answers:
        flight.answers.append(str(mode.mode))


def _nearest(positions: Matrix, about_a_satellite: bool) -> float:
    """Least distance (m) of any two of the satellites at positions (N, 3)."""
    every = np.vstack([np.zeros((1, 3)), positions]) if about_a_satellite else positions
    one, other = np.triu_indices(len(every), 1)
    return float(np.linalg.norm(every[one] - every[other], axis=1).min())


def _coasting(run: Run, about_a_satellite: bool) -> float:
    """Least distance (m) over a day without the victim's thrust, zonal harmonics to degree six; of it to any other."""
    truth = run.plant.truth()
    states = np.array([truth.chief_state, *(each.inertial_state for each in truth.deputies)])
    propagator, least = Propagator(STEP, 1, Forces(zonal_degree=6)), inf
    others = [place for place in range(len(states)) if place != 1 and (place or about_a_satellite)]
    for _ in range(round(COAST / STEP)):
        offsets = states[others] - states[1]
        position, velocity = offsets[:, :3], offsets[:, 3:]
        speed = np.maximum((velocity**2).sum(axis=1), 1e-300)
        when = np.clip(-(position * velocity).sum(axis=1) / speed, 0.0, STEP)
        least = min(least, float(np.linalg.norm(position + when[:, None] * velocity, axis=1).min()))
        states = propagator.propagate(0.0, states, np.zeros((len(states), 3)), np.ones(len(states)))
    return least


@dataclass(frozen=True)
class Row:
    """A fault with and without supervision."""

    fault: Fault
    limit: float
    bare: Flight
    supervised: Flight

    @property
    def is_harmful(self) -> bool:
        """Whether it does harm without supervision."""
        return max(self.bare.error) > HARM or self.bare.nearest < 0.5 * self.bare.planned

    @property
    def verdict(self) -> str:
        """What became of it, or what is missing."""
        flight, delay = self.supervised, self.supervised.delay
        is_kept = flight.mode == Mode.KEEP and flight.error[-1] <= HELD
        end = "kept" if is_kept else "safe" if flight.coasting > self.limit else ""
        if not self.is_harmful:
            return f"no harm, {end}" if end else "**NO**: harm by the answer"
        if delay is None:
            return "**NO**: not found"
        if not end:
            return f"**NO**: ends in {flight.mode}, {flight.error[-1]:.3g} m off"
        if max(flight.error[: delay + 1]) > 0.5 * max(self.bare.error):
            return f"**NO**: found late, {end}"
        return end

    @property
    def line(self) -> str:
        """Line of a Markdown table."""
        flight, delay = self.supervised, self.supervised.delay
        named = any(subject in self.fault.subjects for _, subject in flight.found)
        cells = [
            self.fault.words,
            f"{max(self.bare.error):.3g}",
            f"{self.bare.nearest:.3g}",
            f"{self.bare.delta_v:.3g}",
            f"{flight.first}" + ("" if named or not flight.found else ", wrongly"),
            "" if delay is None else f"{delay}",
            ", ".join(flight.answers) or "none",
            flight.mode,
            f"{max(flight.error):.3g}",
            f"{flight.error[-1]:.3g}",
            f"{flight.nearest:.3g}",
            f"{flight.coasting:.3g}" if isfinite(flight.coasting) else "",
            f"{flight.delta_v:.3g}",
            self.verdict,
        ]
        return "| " + " | ".join(cells) + " |"


HEAD = (
    "| fault | error, m | nearest, m | delta-v, m/s | found first by | after, ticks | answered by | ends in "
    "| largest error, m | at the end, m | nearest, m | a day of coasting, m | delta-v, m/s | outcome |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
)

HEADING = f"""# Faults, with and without supervision

Every fault begins after the acquisition of the formation and stays. The first three figures are of the flight without
supervision (`supervisor.enabled: false`), all others of the flight with it and its default fault table: largest error
of the true position against the target after the onset, least true distance of any two satellites, delta-v of the
satellite with the fault. A flight that does not end in `keep` coasts for a day more, with zonal harmonics to degree
six: the least distance to any other satellite must be above {FORMATIONS["leader_follower"].limit:g} m.

A fault does harm if the error without supervision exceeds {HARM:g} m or a separation falls below half of the planned.
Such a fault has to be found before half of that error, and to end `kept` (in `keep`, within {HELD:g} m) or `safe`.
What falls short of that is marked. Flown in-process by `python -m verification.faults`.
"""


def rows(formation: str, law: str, pool: ProcessPoolExecutor) -> list[Row]:
    """All faults of a formation and law."""
    flights = list(product(FAULTS, (False, True)))
    flown = list(
        pool.map(fly, *zip(*((formation, law, fault, supervised) for fault, supervised in flights), strict=True))
    )
    limit = FORMATIONS[formation].limit
    return [Row(fault, limit, *flown[2 * place : 2 * place + 2]) for place, fault in enumerate(FAULTS)]


def page(laws: Sequence[str]) -> tuple[str, list[Figure]]:
    """The page, and its verdicts as figures."""
    lines, figures = [HEADING], list[Figure]()
    with ProcessPoolExecutor() as pool:
        for formation, law in product(FORMATIONS, laws):
            table = rows(formation, law, pool)
            missed = [row for row in table if row.verdict.startswith("**NO**")]
            figures.append(Figure(f"{formation}, {law}: short", "0", len(missed), "faults", 0.0, 0.0))
            harmful = sum(row.is_harmful for row in table)
            words = f"{harmful} of {len(table)} faults do harm without supervision; {len(missed)} fall short with it."
            lines += [f"## {formation}, {law}", "", words, "", HEAD, *(row.line for row in table), ""]
            print(f"{formation}, {law}: {words}", flush=True)
    return "\n".join(lines), figures


def main(output: Path, laws: Sequence[str] = ("lqr",)) -> int:
    """Write the page; the number of tables in which a fault falls short."""
    text, figures = page(laws)
    (output / "faults.md").write_text(text)
    return sum(not figure.holds for figure in figures)


if __name__ == "__main__":
    sys.exit(main(Path("docs/verification"), sys.argv[1:] or ("lqr",)) > 0)
