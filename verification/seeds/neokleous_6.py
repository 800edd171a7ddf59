"""Neokleous' flights on the filter's estimates: Figs. 4.3, 4.4, 5.10, 5.11 and 6.1 to 6.8.

The flight software flies them (`neokleous.yaml`), measurement noise and filter included. The chief is his ideal point,
which moves on a circle under J2; the satellite moves under J2, Sun and Moon.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.frames import inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.plant.plant import Plant
from formation_gnc.relative.schweighart_sedwick import CircularReference
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from verification.control import GEO_MASS, MINUTE
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours

PAGE = "neokleous"

Array = NDArray[np.float64]

SCENARIO = Path(__file__).with_name("neokleous.yaml")
POINTS = 2000
"""Of a curve in a picture."""

BOUNDARY = 0.1
"""m; within it after 100 minutes (6.2)."""


@dataclass(frozen=True)
class Case:
    """One flight."""

    figures: str
    law: str
    start: float
    """Off the point in every axis, m."""
    minutes: float
    limit: float
    """N per axis."""
    weight: float = 1.0
    """R of LQR."""
    fourth: bool = False
    """Whether right ascension is measured too."""

    @property
    def name(self) -> str:
        """In words."""
        law = f"LQR, R = {self.weight:g} I" if self.law == "lqr" else "H-infinity"
        return f"{self.figures}: {law}, {'four' if self.fourth else 'three'} sensors"


SEEN = (
    Case("Figs. 4.3, 4.4", "lqr", 1.0, 200.0, 100.0, 100.0, True),
    Case("Figs. 5.10, 5.11", "hinf", 1.0, 2880.0, 100.0, fourth=True),
    Case("Figs. 6.1, 6.2", "lqr", 100.0, 200.0, 100.0, 200.0, True),
    Case("Figs. 6.3, 6.4", "hinf", 100.0, 200.0, 100.0, fourth=True),
    Case("Figs. 6.5, 6.6", "lqr", 1000.0, 600.0, 1.0, 200.0, True),
    Case("Figs. 6.7, 6.8", "hinf", 1000.0, 600.0, 1.0, fourth=True),
)
BLIND = tuple(replace(case, fourth=False, minutes=200.0) for case in SEEN[:4])


class PointTruth:
    """The chief as the ideal point, under J2 alone; the others as the plant has it."""

    def __init__(self, plant: Plant) -> None:
        """In place of the propagator of a plant, whose satellites start about a point that stays on its circle."""
        self._whole, self._point = plant._propagator, Propagator(plant.parameters.tick)
        chief, reference = plant._states[0].copy(), CircularReference(float(np.linalg.norm(plant._states[0, :3])), 0.0)
        relative = [plant.parameters.deputy[name].relative_state for name in plant.parameters.deputies]
        chief[3:] *= reference.rate / reference.mean_motion
        plant._states = np.array([chief, *(inertial_from_relative(chief, np.array(each)) for each in relative)])

    def illumination(self, time: float, state: Array) -> float:
        """As the plant has it."""
        return self._whole.illumination(time, state)

    def propagate_with_thrust(self, time: float, states: Array, forces: Array, masses: Array) -> Array:
        """States one tick later."""
        moved = self._whole.propagate_with_thrust(time, states, forces, masses)
        moved[0] = self._point.propagate(time, states[:1], np.zeros((1, 3)))[0]
        return moved


@dataclass(frozen=True)
class Flight:
    """What flew; times in minutes, SI else."""

    true: Array
    """(N, 6) relative states."""
    estimated: Array
    """(N, 6)"""
    forces: Array
    """(N, 3), N"""
    radii: Array
    """(N, 2) of the point and of the satellite."""
    rates: Array
    """(N, 2) rad/s, of both."""

    @property
    def minutes(self) -> Array:
        """(N,)"""
        return np.arange(len(self.true)) * 0.1


def fly(case: Case) -> Flight:
    """One flight on estimates."""
    own: dict[str, Any] = (
        {
            "position_error": [1.0] * 3,
            "velocity_error": [1.0 / MINUTE] * 3,
            "thrust": [GEO_MASS / (math.sqrt(case.weight) * MINUTE**2)] * 3,
        }
        if case.law == "lqr"
        else {
            "bandwidth": [1.0 / MINUTE] * 3,
            "steady_error": [0.03] * 3,
            "uncertainty_time": [0.05 * MINUTE] * 3,
            "thrust": [GEO_MASS / (1.5 * MINUTE**2)] * 3,
            "pole_shift": 0.1 / MINUTE,
            "disturbance": 0.0,
            "gamma_margin": 0.05,
        }
    )
    flown = load_scenario(
        str(SCENARIO),
        {
            "/plant": {
                "duration": case.minutes * MINUTE,
                "deputy1.relative_state": [case.start] * 3 + [0.0] * 3,
                "deputy1.thrusters.limit": [case.limit] * 3,
                "deputy1.sensors.right_ascension.on": case.fourth,
            },
            "/**/controller": {"algorithm": case.law} | {f"{case.law}.{name}": value for name, value in own.items()},
        },
    )
    run = Run(flown)
    run.plant._propagator = PointTruth(run.plant)  # type: ignore[assignment]
    kept: dict[str, list[Any]] = {"/truth": [], "/deputy1/estimate": [], "/deputy1/thrust": []}
    run.fly(lambda topic, record: kept[topic].append(record) if topic in kept else None)
    both = np.array([[each.chief_state, each.deputies[0].inertial_state] for each in kept["/truth"]])
    radii = np.linalg.norm(both[:, :, :3], axis=2)
    momenta = np.linalg.norm(np.cross(both[:, :, :3], both[:, :, 3:]), axis=2)
    return Flight(
        np.array([each.deputies[0].relative_state for each in kept["/truth"]]),
        np.array([each.relative_state for each in kept["/deputy1/estimate"]]),
        np.array([each.force for each in kept["/deputy1/thrust"]]),
        radii,
        momenta / radii**2,
    )


covers(
    "Neokleous Fig. 4.3; Fig. 4.4",
    "control/lqr.py",
    "navigation/navigation_filter.py",
    figures=("Figs. 4.3, 4.4, three sensors: error after 100 min", "Figs. 4.3, 4.4, four sensors: error after 100 min"),
    differs="three sensors do not see what Sun and Moon do along the track, which is lost; four leave LQR's static "
    "offset. Noise and mass are not printed, and the plot is lost in the text; ours is neokleous_states.png",
)
covers(
    "Neokleous Fig. 5.10; Fig. 5.11",
    "control/hinf.py",
    "navigation/navigation_filter.py",
    figures=(
        "Figs. 5.10, 5.11, three sensors: error after 100 min",
        "Figs. 5.10, 5.11, four sensors: error after 100 min",
    ),
    differs="the same, with the weights of (6.4)-(6.6), as w_u of (5.41) is not printed; ours is neokleous_states.png",
)
covers(
    "Neokleous Fig. 6.1; Fig. 6.2",
    "control/lqr.py",
    "navigation/navigation_filter.py",
    figures=(
        "Figs. 6.1, 6.2, three sensors: error after 100 min",
        "Figs. 6.1, 6.2, four sensors: error after 100 min",
        "Figs. 6.1, 6.2, four sensors: largest force",
    ),
    differs="the boundary is not kept under Sun and Moon: LQR has a static offset, and three sensors do not see the "
    "track. The plot is lost in the text; ours is neokleous_forces.png",
)
covers(
    "Neokleous Fig. 6.3; Fig. 6.4",
    "control/hinf.py",
    "navigation/navigation_filter.py",
    figures=(
        "Figs. 6.3, 6.4, three sensors: error after 100 min",
        "Figs. 6.3, 6.4, four sensors: error after 100 min",
        "Figs. 6.3, 6.4, four sensors: largest force",
    ),
    differs="the boundary is not kept under Sun and Moon: H-infinity has a static offset too, and three "
    "sensors do not see "
    "the track. The plot is lost in the text; ours is neokleous_forces.png",
)
covers(
    "Neokleous Fig. 6.5; Fig. 6.6",
    "control/lqr.py",
    "navigation/navigation_filter.py",
    figures=("Figs. 6.5, 6.6, four sensors: last hour",),
    differs="with a fourth sensor; the plot is lost in the text; ours is neokleous_forces.png",
)
covers(
    "Neokleous Fig. 6.7; Fig. 6.8",
    "control/hinf.py",
    "navigation/navigation_filter.py",
    figures=("Figs. 6.7, 6.8, four sensors: last hour",),
    differs="with a fourth sensor; the plot is lost in the text; ours is neokleous_forces.png",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """All flights."""
    flights = {case: fly(case) for case in (*BLIND, *SEEN)}
    ours = Ours()
    lines = [
        "## Chapters 4 to 6: flights on the filter's estimates",
        "",
        f"{GEO_MASS:g} kg, ticks of 6 s; radius, range rate and latitude (0.1 m, 0.1 mm/s, 1e-9 rad), right ascension",
        "(1e-9 rad) as a fourth, and a fix of 3 cm and 0.01 mm/s at the start. Noise and mass are not printed.",
        "Errors of",
        "the true position, the largest axis; of the estimate RMS over the last hour.",
        "",
        "| flight | from, m | limit, N | after 100 min, m | last hour, m | estimate off by x, y, z, m | "
        "largest force, N |"
        " impulse, N s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    figures: list[Figure] = []
    for case, flight in flights.items():
        words, more = weigh(case, flight, ours)
        lines.append(f"| {case.name} | {case.start:g} | {case.limit:g} | " + " | ".join(words) + " |")
        figures += more
    draw_states({case: flights[case] for case in (*BLIND[:2], *SEEN[:2])}, directory / "neokleous_states.png")
    draw_forces({case: flights[case] for case in SEEN[2:]}, directory / "neokleous_forces.png")
    lines += [
        "",
        "**Along the track.** None of the three sensors sees it (docs/theory/navigation.md), and so nothing",
        "answers what",
        "Sun and Moon, which the filter does not know, do there: the satellite leaves the point while every",
        "reading says",
        "that it is there. That his figures show it at rest is possible only of a filter, or of a disturbance, that",
        "knows the truth. A fourth reading mends it.",
        "",
        "**A steady disturbance.** Under some 5e-6 m/s², 0.02 m/min², a gain of about 1/sqrt(R) leaves decimetres, and",
        "H-infinity without an integral some too: more than the boundary of 6.2 by either law. On the truth and",
        "without",
        "Sun and Moon both keep it ([control](control.md#neokleous-geostationary)).",
        "",
        "![States](neokleous_states.png)",
        "",
        "![Boundary and forces](neokleous_forces.png)",
        "",
    ]
    return "\n".join(lines), [*figures, *ours.cells]


def weigh(case: Case, flight: Flight, ours: Ours) -> tuple[list[str], list[Figure]]:
    """Words of a line, and what is held to the document, of one flight."""
    error = np.abs(flight.true[:, :3]).max(axis=1)
    off = np.sqrt(np.mean((flight.estimated - flight.true)[-600:, :3] ** 2, axis=0))
    later, last, force = float(error[1000:].max()), float(error[-600:].max()), float(np.abs(flight.forces).max())
    impulse = float(np.abs(flight.forces).sum()) * 0.1 * MINUTE
    words = [
        ours(f"{case.name}: after 100 min", later, ".3g", "m", 0.02 * later),
        ours(f"{case.name}: last hour", last, ".3g", "m", 0.02 * last),
        ", ".join(
            ours(f"{case.name}: estimate of {axis}", off[i], ".2g", "m", 0.05 * off[i]) for i, axis in enumerate("xyz")
        ),
        ours(f"{case.name}: force", force, ".4g", "N", 0.01 * force),
        ours(f"{case.name}: impulse", impulse, ".4g", "N s", 0.01 * impulse),
    ]
    name = f"{case.figures}, {'four' if case.fourth else 'three'} sensors"
    if case.start == 1000.0:
        return words, [Figure(f"{name}: last hour", "stabilised", last, "m", 0.0, 10.0)]
    claim = "within 0.1 m" if case.start == 100.0 else "goes to zero"
    least, most = (0.0, 1.0) if case.fourth else (50.0, math.inf)
    figures = [Figure(f"{name}: error after 100 min", claim, later, "m", least, most)]
    if case.start == 100.0:
        figures.append(Figure(f"{name}: largest force", "within 100 N", force, "N", 0.0, 100.0))
    return words, figures


def draw_states(flights: dict[Case, Flight], path: Path) -> None:
    """Rates, x, y, z, radius and r1 - r2, as Figs. 4.3 and 4.4 (200 minutes), 5.10 and 5.11 (two days)."""
    plot, panels = plt.subplots(len(flights), 6, figsize=(24, 8))
    for row, (case, flight) in zip(panels, flights.items(), strict=True):
        part = slice(None, None, max(1, len(flight.minutes) // POINTS))
        minutes = flight.minutes[part]
        row[0].plot(minutes, MINUTE * flight.rates[part, 0], "k--", label="ideal")
        row[0].plot(minutes, MINUTE * flight.rates[part, 1], label="satellite")
        row[0].set(title=case.name, ylabel="omega, rad/min")
        for i, panel in enumerate(row[1:4]):
            panel.plot(minutes, flight.estimated[part, i], color="tab:orange", label="estimated")
            panel.plot(minutes, flight.true[part, i], color="tab:blue", lw=1.0, label="true")
            panel.set(ylabel=f"{'xyz'[i]}, m")
        row[4].plot(minutes, flight.radii[part, 0] - flight.radii[0, 0], "k--", label="r1")
        row[4].plot(minutes, flight.radii[part, 1] - flight.radii[0, 0], label="r2")
        row[4].set(ylabel=f"radius less {1e-3 * flight.radii[0, 0]:.0f} km, m")
        row[5].semilogy(minutes, np.abs(flight.radii[part, 0] - flight.radii[part, 1]) + 1e-6)
        row[5].set(ylabel="abs(r1 - r2), m")
        for panel in row:
            panel.set(xlabel="min")
        for panel in (row[0], row[1], row[4]):
            panel.legend()
    save(plot, path)


def draw_forces(flights: dict[Case, Flight], path: Path) -> None:
    """r1 - r2 with the boundary, the whole radius, and the forces, as Figs. 6.1 to 6.8."""
    plot, panels = plt.subplots(len(flights), 5, figsize=(24, 16))
    for row, (case, flight) in zip(panels, flights.items(), strict=True):
        off = flight.radii[:, 0] - flight.radii[:, 1]
        row[0].plot(flight.minutes, flight.radii[:, 1] - flight.radii[0, 0], label="r2")
        row[0].plot(flight.minutes, flight.radii[:, 0] - flight.radii[0, 0], "k--", label="r1")
        row[0].set(title=case.name, ylabel=f"radius less {1e-3 * flight.radii[0, 0]:.0f} km, m")
        row[0].legend()
        row[1].plot(flight.minutes, off)
        row[1].axhline(BOUNDARY, color="k", ls=":")
        row[1].axhline(-BOUNDARY, color="k", ls=":")
        row[1].axvline(100.0, color="k", ls=":")
        row[1].set(ylabel="r1 - r2, m")
        if case.start == 100.0:
            row[1].set(ylim=(-5.0 * BOUNDARY, 5.0 * BOUNDARY))
        for i, panel in enumerate(row[2:]):
            panel.plot(flight.minutes, flight.forces[:, i])
            panel.set(ylabel=f"F{'xyz'[i]}, N")
            if case.start == 100.0:
                panel.set(xlim=(0.0, 150.0))
        for panel in row:
            panel.set(xlabel="min")
    save(plot, path)
