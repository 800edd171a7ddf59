"""NetSat's acquisitions under J2 by the laws of relative elements, beside Kremmydas' MPC and the least possible.

`verification/acquisitions.py` flies them with his MPC on his truth. Here the truth has J2, targets move as J2 moves
them (`relative_elements`), order and phase are assigned, and knowledge is perfect.
"""

import csv
import math
import sys
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from formation_gnc.control.thrust_response import ThrustResponse
from formation_gnc.orbit.elements import elements_from_state
from formation_gnc.relative.elements_model import RelativeElementsModel
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario
from verification.acquisitions import ACQUISITIONS, LIMIT, MASS, NETSAT, ORBITS, Acquisition, Setting, scenario
from verification.figure import Figure
from verification.omniscient import Omniscient

Array = NDArray[np.float64]

LAWS: dict[str, dict[str, Any]] = {
    "mpc": {},
    "roe_lyapunov": {"roe_lyapunov.off_in_eclipse": True},
    "convex": {
        "convex.model": "relative_elements",
        "convex.off_in_eclipse": True,
        "convex.final_time": 97.0,
        "convex.holding_time": 1.0,
        "convex.replan_interval": 5.0,
        "convex.last_plan": 0.5,
    },
}
"""Times of `convex` in revolutions."""


@dataclass(frozen=True)
class Acquired:
    """What flew, of all four satellites."""

    delta_v: Array
    """(4,) sum over the axes, m/s."""
    least: Array
    """(4,) without which no law comes to the target in this time with these eclipses, m/s."""
    final: Array
    """(4,) largest error in the last orbit, m."""
    start: Array
    """(4,) error at the start, m."""
    fallbacks: int
    """Ticks with a fallback."""
    in_eclipse: float
    """Largest force in a tick that meets an eclipse, uN."""

    @property
    def over(self) -> float:
        """Delta-v of all over the least."""
        return float(self.delta_v.sum() / self.least.sum())


def flown_by(acquisition: Acquisition, law: str) -> Scenario:
    """The acquisition with targets by mean elements, by a law."""
    period = math.tau / load_scenario(str(NETSAT)).plant.mean_motion
    own = dict(LAWS[law])
    if law == "convex":
        step = acquisition.step * max(1, round(200.0 / acquisition.step))
        for name in ("final_time", "holding_time", "replan_interval", "last_plan"):
            own[f"convex.{name}"] = round(own[f"convex.{name}"] * period / step) * step
        own["convex.step"] = step
    changes = {"/**/guidance": {"model": "relative_elements"}, "/**/controller": {"algorithm": law} | own}
    return scenario(acquisition, Setting(17.0, shared=True, truth="J2"), changes)


def fly(acquisition: Acquisition, law: str) -> Acquired:
    """One acquisition, to the end."""
    flown = flown_by(acquisition, law)
    run, records = Run(flown), dict[str, list[Any]]()
    names = run.plant.parameters.deputies
    for name in names:
        run.instances[f"/{name}/navigation"].module = Omniscient(run.plant, name)
    run.fly(lambda topic, record: records.setdefault(topic, []).append(record))
    states = np.array([[each.relative_state for each in truth.deputies] for truth in records["/truth"]])
    targets = np.array([[each.relative_state for each in records[f"/{name}/target"]] for name in names])
    forces = np.array([[each.force for each in records[f"/{name}/thrust"]] for name in names])
    dark = np.array([any(each.eclipse for each in truth.deputies) for truth in records["/truth"]])
    shaded = dark | np.append(dark[1:], False)
    errors = np.linalg.norm((states.transpose(1, 0, 2) - targets)[:, :, :3], axis=2)
    chief, tick = records["/truth"][0].chief_state, flown.plant.tick
    return Acquired(
        np.abs(forces).sum(axis=(1, 2)) * tick / MASS,
        np.array([least_delta_v(chief, states[0, k], targets[k, 0], tick, ~shaded[:-1]) for k in range(len(names))]),
        errors[:, -len(errors[0]) // ORBITS :].max(axis=1),
        errors[:, 0],
        sum(bool(status.fallback) for name in names for status in records[f"/{name}/status"]),
        1e6 * float(np.abs(forces[:, shaded]).max()),
    )


def least_delta_v(chief: Array, start: Array, goal: Array, tick: float, light: NDArray[np.bool_]) -> float:
    """Least delta-v (m/s, sum over the axes) to a target that moves freely under J2, by a linear programme.

    Args:
        chief: (6,) inertial state at the start.
        start: (6,) state at the start.
        goal: (6,) target at the start.
        tick: s, over which an acceleration is held.
        light: (N,) of each tick, whether there is thrust in it.
    """
    model = RelativeElementsModel.about(elements_from_state(chief))
    response = ThrustResponse.of(model, 0.0, tick, len(light), 0)
    unit = np.repeat([1.0, math.tau / model.period], 3)
    error = (model.averaged(chief, start) - model.averaged(chief, goal)) / unit
    scale, limit = np.abs(error).max(), LIMIT / MASS
    forced = np.hstack(list(response.pushed[light] * limit / unit[:, None])) / scale
    # The motion of a target reached is free: the error at the start that all thrust takes back.
    drift = 1.0 / np.array([1.0, ORBITS, 1.0, 1.0, 1.0, 1.0])
    found = linprog(
        np.ones(2 * forced.shape[1]),
        A_eq=np.hstack([forced, -forced]) * drift[:, None],
        b_eq=-error / scale * drift,
        bounds=(0.0, 1.0),
        method="highs-ipm",
    )
    return float(found.fun) * limit * tick if found.success else math.inf


HEADING = f"""## Low thrust: NetSat's acquisitions under J2

Kremmydas' four satellites of {MASS:g} kg with {LIMIT * 1e6:g} uN per axis, dark in eclipse, {ORBITS} orbits, as on the
page of [control](control.md), but with J2 in the truth and targets as J2 moves them (`relative_elements`); order and
phase assigned, perfect knowledge. `convex` plans on mean relative elements for 97 orbits, anew every five. Delta-v is
the sum over the axes of all four satellites; the least is that of a linear programme (HiGHS) on the linear motion
under J2, through the same eclipses. Each flight takes minutes: `python -m verification.low_thrust NUMBER LAW` flies
one and keeps it in `verification/low_thrust.csv`, of which this is written.

| acquisition | law | delta-v, mm/s | least, mm/s | over the least | worst, last orbit, m | fallbacks | uN in eclipse |
|---|---|---|---|---|---|---|---|"""

KEPT = Path(__file__).with_name("low_thrust.csv")

GOALS = {"convex": (1.3, 5.0)}
"""Largest delta-v over the least, and error in the last orbit, m."""


@dataclass(frozen=True)
class Row:
    """A flight as it is kept."""

    acquisition: str
    law: str
    delta_v: float
    """Of all satellites, mm/s."""
    least: float
    """The same, mm/s."""
    error: float
    """m"""
    fallbacks: int
    in_eclipse: float
    """uN"""


def keep(number: int, law: str) -> None:
    """Fly an acquisition and keep its figures."""
    flown = fly(ACQUISITIONS[number], law)
    sums = 1e3 * float(flown.delta_v.sum()), 1e3 * float(flown.least.sum()), float(flown.final.max())
    row = Row(ACQUISITIONS[number].name, law, *sums, flown.fallbacks, flown.in_eclipse)
    rows = [each for each in kept() if (each.acquisition, each.law) != (row.acquisition, row.law)]
    with KEPT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([each.name for each in fields(Row)])
        writer.writerows(sorted(astuple(each) for each in [*rows, row]))


def kept() -> list[Row]:
    """Flights that are kept."""
    if not KEPT.exists():
        return []
    with KEPT.open() as file:
        return [
            Row(each["acquisition"], each["law"], *(float(each[name]) for name in ("delta_v", "least", "error")),
                int(each["fallbacks"]), float(each["in_eclipse"]))
            for each in csv.DictReader(file)
        ]  # fmt: skip


def acquisitions() -> tuple[str, list[Figure]]:
    """What is kept, and what of it is to be."""
    lines, figures = [HEADING], list[Figure]()
    for row in kept():
        over = row.delta_v / row.least
        cells = [row.acquisition, row.law, f"{row.delta_v:.0f}", f"{row.least:.0f}", f"{over:.3f}", f"{row.error:.3g}"]
        lines.append(f"| {' | '.join(cells)} | {row.fallbacks} | {row.in_eclipse:g} |")
        if row.law in GOALS:
            most, error = GOALS[row.law]
            name = f"{row.acquisition}: {row.law}"
            figures.append(Figure(f"{name}, delta-v over the least", f"at most {most:g}", over, "", 1.0, most))
            figures.append(Figure(f"{name}, error", f"below {error:g} m", row.error, "m", 0.0, error))
    flown = {(row.acquisition, row.law) for row in kept()}
    missing = [f"{each.name} by `{law}`" for each in ACQUISITIONS for law in LAWS if (each.name, law) not in flown]
    if missing:
        lines += ["", f"Not flown yet: {'; '.join(missing)}."]
    return "\n".join([*lines, ""]), figures


if __name__ == "__main__":
    keep(int(sys.argv[1]), sys.argv[2])
