"""Relative orbital elements against heyoka, and a reconfiguration by impulses beside its bound.

`main` writes `relative_elements.md`, and returns the number of figures outside their tolerance.
"""

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    state_from_elements,
    true_from_mean_anomaly,
)
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.mean import mean_elements
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.parameters import load
from formation_gnc.records import NavigationState
from formation_gnc.relative.relative_elements import (
    NAMES,
    drifted,
    hill_matrix,
    j2_transition,
    kepler_transition,
    mean_relative_elements,
    osculating_relative_elements,
    relative_elements,
    state_from_mean,
    state_from_osculating,
)
from formation_gnc.types import NANOSECONDS
from verification.figure import TABLE, Cell, Figure, failures
from verification.formation_cases import formations
from verification.independent import Heyoka
from verification.low_thrust import acquisitions

Array = NDArray[np.float64]

ORBITS = 10
PERIGEE = 7e6
ECCENTRICITIES = (0.0, 0.001, 0.1, 0.3, 0.5, 0.7)
SIZES = (10.0, 100.0, 1e3, 1e4, 1e5)
SHAPE = np.array([0.01, 1.0, 0.5, -0.3, 0.2, 0.4])
"""Elements over the size; the semi-major axes differ by a hundredth."""

TERRASAR = Elements(
    6886536.686,
    0.0001264,
    math.radians(97.4453),
    math.radians(351.0108),
    math.radians(101.2452),
    true_from_mean_anomaly(math.radians(11.652), 0.0001264),
)


def chief_of(eccentricity: float) -> Elements:
    """Chief with a common perigee."""
    return Elements(PERIGEE / (1.0 - eccentricity), eccentricity, 1.0, 0.3, 0.4, 0.5)


def table(title: str, rows: dict[float, list[float]]) -> str:
    """Metres by eccentricity and size."""
    head = f"| {title} | " + " | ".join(f"{size:g} m" for size in SIZES) + " |\n" + "|---" * (len(SIZES) + 1) + "|\n"
    return head + "\n".join(f"| e = {e:g} | " + " | ".join(f"{v:.2g}" for v in row) + " |" for e, row in rows.items())


def round_trips() -> tuple[str, list[Figure]]:
    """Exact maps to the Hill state and back, and the linear map beside them."""
    figures: list[Figure] = []
    exact: dict[float, list[float]] = {}
    linear: dict[float, list[float]] = {}
    for e in ECCENTRICITIES:
        chief = chief_of(e)
        inertial = state_from_elements(chief)
        exact[e], linear[e] = [], []
        for size in SIZES:
            relative = size * SHAPE
            ways = (
                (state_from_osculating, osculating_relative_elements),
                (state_from_mean, mean_relative_elements),
            )
            off = [np.abs(back(inertial, there(inertial, relative)) - relative).max() for there, back in ways]
            exact[e].append(float(max(off)))
            error = state_from_osculating(inertial, relative) - hill_matrix(chief) @ relative
            linear[e].append(float(np.linalg.norm(error[:3])))
            figures.append(Cell(f"round trip, e = {e:g}, {size:g} m", "rounding", exact[e][-1], "m", 0.0, 1e-5))
    order = math.log10(linear[0.1][3] / linear[0.1][2])
    figures.append(Figure("order of the linear map's error, 1 to 10 km, e = 0.1", "2", order, "", 1.9, 2.1))
    text = f"""## Maps

Largest error of any element after the way to the Hill state and back, osculating and mean, m:

{table("round trip", exact)}

Position error of the linear map, m:

{table("linear map", linear)}
"""
    return text, figures


def transitions() -> tuple[str, list[Figure]]:
    """Transition matrices against two orbits by heyoka under point mass and J2."""
    truth = Heyoka(Forces(zonal_degree=2), 0.0, np.float64)
    names = ("Kepler", "J2", "J2, any separation")
    errors: dict[str, dict[float, list[float]]] = {name: {e: [] for e in ECCENTRICITIES} for name in names}
    for e in ECCENTRICITIES:
        chief = chief_of(e)
        inertial, mean = state_from_elements(chief), mean_elements(chief)
        duration = ORBITS * chief.period
        end = truth.fly(inertial, duration)
        for size in SIZES:
            relative = size * SHAPE
            deputy = inertial_from_relative(inertial, state_from_mean(inertial, relative))
            moved = [mean_elements(elements_from_state(each)) for each in (end, truth.fly(deputy, duration))]
            found = relative_elements(*moved)
            ours = (
                kepler_transition(mean, duration) @ relative,
                j2_transition(mean, duration) @ relative,
                drifted(mean, relative, duration),
            )
            for name, each in zip(names, ours, strict=True):
                errors[name][e].append(float(np.abs(each - found).max()))
    figures: list[Figure] = []
    for e in ECCENTRICITIES:
        share = errors["J2, any separation"][e][2] / 1e3
        figures.append(
            Figure(f"J2, any separation, 1 km, e = {e:g}, of the size", "order of J2^2", share, "", 0.0, 1e-3)
        )
        gain = errors["Kepler"][e][1] / errors["J2"][e][1]
        figures.append(Figure(f"Kepler's error over J2's, 100 m, e = {e:g}", "order of 1 / J2", gain, "", 30.0, 1e6))
    sections = "\n\n".join(f"{table(name, rows)}" for name, rows in errors.items())
    text = f"""## Transition matrices

Largest error of any mean element after {ORBITS} orbits under point mass and J2, flown by heyoka, m; perigee at
{PERIGEE / 1e3:.0f} km, i = 1 rad; elements {", ".join(NAMES)} of
{", ".join(f"{each:g}" for each in SHAPE)} times the size:

{sections}

The matrices are of first order in the separation; `drifted` takes both absolute orbits, so that J2^2 alone remains.
"""
    return text, figures


def reconfiguration() -> tuple[str, list[Figure]]:
    """From a dey = 300 m, a diy = 400 m to a diy = 500 m under J2, by the law `impulsive`."""
    tick, mass = 10.0, 1340.0
    orbit = {f"chief.{name}": value for name, value in vars(TERRASAR).items()} | {"tick": tick}
    formation = {"formation": "relative_elements", "model": "relative_elements"}
    goal = {"relative_elements.dey": 300.0, "relative_elements.diy": 500.0}
    law = {"algorithm": "impulsive", "impulsive.tolerance": 0.5, "mass": mass, "thrust_limit": (1.0, 1.0, 1.0)}
    guidance = Guidance("/deputy1/guidance", load(GuidanceParameters, orbit | formation | goal))
    manager = ControllerManager("/deputy1/controller", load(ControllerParameters, orbit | law))
    chief = state_from_elements(TERRASAR)
    deputy = inertial_from_relative(chief, state_from_mean(chief, np.array([0.0, 0.0, 0.0, 300.0, 0.0, 400.0])))
    spent, burns, ticks = 0.0, [], round(3.0 * TERRASAR.period / tick)
    for k in range(ticks):
        estimate = NavigationState(round(k * tick * NANOSECONDS), relative_from_inertial(chief, deputy), chief, mass)
        target, _ = guidance.on_tick(estimate)
        thrust, status = manager.on_tick(estimate, target)
        if status.solver.startswith("burn "):
            burns.append(f"- {k * tick:.0f} s: {status.solver}")
        spent += float(np.linalg.norm(thrust.force)) / mass * tick
        push = hill_rotation(chief).T @ thrust.force / mass
        chief = propagate_with_transition(chief, np.zeros(3), tick, 1)[0]
        deputy = propagate_with_transition(deputy, push, tick, 1)[0]
    path = guidance.configuration.design.anchored(chief, ticks * tick)
    states = relative_from_inertial(chief, deputy), path.states(np.array([ticks * tick]))[0]
    found, wanted = (mean_relative_elements(chief, each) for each in states)
    bound = TERRASAR.mean_motion * 100.0
    figures = [
        Figure("delta-v over n a Ddi = 0.1105 m/s", "within 1 %", spent / bound, "", 0.99, 1.01),
        Figure("largest error of a final element", "below 1 m", float(np.abs(found - wanted).max()), "m", 0.0, 1.0),
    ]
    listed = "\n".join(burns)
    text = f"""## Reconfiguration by impulses

a = 6886.536686 km, e = 0.0001264, i = 97.4453 deg, RAAN 351.0108, argument of perigee 101.2452, mean anomaly
11.652 deg: from a dey = 300 m, a diy = 400 m to a diy = 500 m, 1340 kg with 1 N per axis, ticks of 10 s, three orbits
under J2 with perfect knowledge; {spent:.5f} m/s beside {bound:.5f} m/s.

{listed}

| | {" | ".join(NAMES)} |
|---|---|---|---|---|---|---|
| final, m | {" | ".join(f"{each:.3f}" for each in found)} |
| target, m | {" | ".join(f"{each:.3f}" for each in wanted)} |
"""
    return text, figures


def main(directory: Path) -> int:
    """Write the page; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    sections, figures = [], []
    for part in (round_trips, transitions, reconfiguration, formations, acquisitions):
        text, limits = part()
        rows = [each.row for each in limits if not isinstance(each, Cell) or not each.holds]
        sections.append("\n".join([text, TABLE, *rows, ""]))
        figures += limits
    heading = "# Relative orbital elements\n\nWritten by `verification/relative_elements.py`.\n\n"
    (directory / "relative_elements.md").write_text(heading + "\n".join(sections))
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
