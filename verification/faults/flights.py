"""A flight with a fault, and what came of it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import numpy as np

from formation_gnc.mode_records import HealthReport, Mode, ModeState
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import Estimate, Event, Measurement
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario
from formation_gnc.supervision.monitor import Level
from formation_gnc.types import NANOSECONDS, Matrix
from verification.faults.injected import Fault

VICTIM = "deputy1"

COAST, STEP = 86400.0, 60.0
"""Time of coasting after a flight, and its step, s."""


@dataclass(frozen=True)
class Formation:
    """What is flown."""

    onset: float
    """Time at which the fault begins, after the acquisition, s."""
    duration: float
    limit: float
    """Least distance that is safe, m: the tube, as no `least_separation` is set."""
    about_a_satellite: bool
    """Whether the chief is one."""


FORMATIONS = {
    "leader_follower": Formation(6005.0, 17403.0, 10.0, True),
    "tetrahedral": Formation(4005.0, 8800.0, 10.0, False),
}


class Misled:
    """Stands where the navigation does, and gives estimates that are off, or always the same, from a time on."""

    def __init__(self, module: Any, onset: float, fault: Fault) -> None:
        """Around a module; onset: s."""
        self._module, self._onset, self._fault = module, round(onset * NANOSECONDS), fault
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

    tick: float
    """s."""
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
        return " ".join(min(self.found, key=self.found.__getitem__)).strip() if self.found else ""


def scenario(formation: str, law: str, tick: float, overrides: dict[str, dict[str, Any]] | None = None) -> Scenario:
    """Scenario of a formation with a law, on ticks of so many s, or its own where they are longer."""
    tick = max(tick, load_scenario(formation).plant.tick)
    changes = {"/**": {"tick": tick}, "/**/controller": {"algorithm": law}}
    return load_scenario(formation, changes | (overrides or {}))


def fly(formation: str, law: str, tick: float, fault: Fault, supervised: bool) -> Flight:
    """One flight."""
    given = FORMATIONS[formation]
    limit = load_scenario(formation).plant.deputy[VICTIM].thrusters.limit[1]
    fields = fault.fields.replace("{limit}", f"{limit}").replace("{leak}", f"{limit / 20.0}")
    faults = [f"{{at: {given.onset}, deputy: {VICTIM}, {fields}}}"] if fields else []
    overrides = {"/plant": {"faults": faults}, "/**/supervisor": {"enabled": supervised}}
    run = Run(scenario(formation, law, tick, overrides))
    if not fields:
        instance = run.instances[f"/{VICTIM}/navigation"]
        instance.module = Misled(instance.module, given.onset, fault)
    flight, records = Flight(run.plant.parameters.tick), dict[str, Any]()

    def sink(topic: str, record: Any) -> None:
        if not isinstance(record, Event):
            records[topic] = record

    onset = int(given.onset / flight.tick)
    for number in range(int(given.duration / flight.tick)):
        records.clear()
        run.tick(sink)
        if number >= onset:
            _note(flight, records, number - onset, run.plant.parameters.deputies, given.about_a_satellite)
    if flight.mode != Mode.KEEP:
        flight.coasting = _coasting(run, given.about_a_satellite)
    return flight


def _note(flight: Flight, records: dict[str, Any], tick: int, deputies: Sequence[str], about_a_satellite: bool) -> None:
    truth = records["/truth"]
    states = np.array([each.relative_state[:3] for each in truth.deputies])
    targets = [records.get(f"/{name}/target") for name in deputies]
    if targets[0] is not None:
        flight.error.append(float(np.linalg.norm(states[0] - targets[0].relative_state[:3])))
    flight.nearest = min(flight.nearest, _nearest(states, about_a_satellite))
    if all(each is not None for each in targets):
        aims = np.array([each.relative_state[:3] for each in targets])
        flight.planned = min(flight.planned, _nearest(aims, about_a_satellite))
    flight.delta_v += flight.tick * float(np.abs(truth.deputies[0].applied_force).sum()) / truth.deputies[0].mass
    health: HealthReport | None = records.get(f"/{VICTIM}/health")
    for each in health.statuses if health else ():
        if each.level == Level.FAILED:
            flight.found.setdefault((each.monitor, each.subject), tick)
    mode: ModeState = records[f"/{VICTIM}/mode"]
    flight.mode = mode.mode
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
