"""Owis' constellation in flight: six GNSS satellites of a plane raised to their slots by the flight software."""

from dataclasses import dataclass
from math import pi, sqrt, tau
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.asre import Asre, AsreParameters
from formation_gnc.control.models import PLAN_MODELS
from formation_gnc.control.plan import Task
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import relative_from_inertial
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours, joined
from verification.seeds.owis import asre, flown, optimum, radial
from verification.seeds.owis_more import FIRST, GNSS

PAGE = "owis"
SLOTS, HIGH, FINAL = 6, 1.2 * GNSS, 30_640.0
"""Slots of the plane; their distance, m; the final time, s."""
UNIT = sqrt(GNSS**3 / MU)
"""Canonical unit of time, s."""
ARGUMENT = 1.5 * pi - FINAL * sqrt(MU / HIGH**3)
"""Argument of latitude of the first slot at the start, rad."""
OFF = np.array([0.01 * GNSS, 0.01 * GNSS, 0.0, 0.01 * sqrt(MU / GNSS), 0.01 * sqrt(MU / GNSS), 0.0])
"""Error of a perturbed start, m and m/s: a hundredth of each canonical unit."""

Array = NDArray[np.float64]

covers(
    "Owis GNSS constellation; Fig. 1",
    "control/asre.py",
    "control/finite_horizon.py",
    figures=(
        "constellation flown: greatest error at the final time",
        "constellation flown: largest angle between neighbours off 60 deg",
        "constellation flown: greatest J over the optimum",
    ),
    differs="flown relative to each slot, in its Hill frame, not in polar coordinates about the Earth, with J2 to J4, "
    "Sun, Moon, a filter, and plans made anew",
)


@dataclass(frozen=True)
class Flight:
    """One satellite's, all truth."""

    times: Array
    """(N,) s."""
    plane: Array
    """(N, 2) position in the orbit plane from the node, m."""
    slot: Array
    """(N, 2) the same of the slot."""
    error: Array
    """(N,) distance from the slot, m."""
    acceleration: Array
    """(N, 3) by thrust, m/s^2."""
    force: float
    """Largest on an axis, N."""
    propellant: float
    """kg."""
    failures: int
    """Plans that failed."""

    @property
    def arrival(self) -> int:
        """Index of the final time."""
        return round(FINAL / self.tick)

    @property
    def tick(self) -> float:
        """s."""
        return float(self.times[1] - self.times[0])

    @property
    def delta_v(self) -> float:
        """Up to the final time, of the magnitude, m/s."""
        return float(np.linalg.norm(self.acceleration[: self.arrival], axis=1).sum()) * self.tick

    @property
    def cost(self) -> float:
        """J of (1.2) with Q = 0, R = I, in canonical units."""
        return 0.5 * float((self.acceleration[: self.arrival] ** 2).sum()) * self.tick / (MU / GNSS**2) ** 2 / UNIT


def fly(slot: int, off: Array | None = None) -> Flight:
    """The satellite of a slot, its state off by (6,) at the start."""
    plant = load_scenario("gnss_raising").plant
    changes: dict[str, Any] = {"/**": {"chief.true_anomaly": (ARGUMENT + tau * slot / SLOTS) % tau}}
    if off is not None:
        changes["/plant"] = {
            "deputy1.relative_state": (np.array(plant.deputy["deputy1"].relative_state) + off).tolist()
        }
    records: dict[str, list[Any]] = {}
    Run(load_scenario("gnss_raising", changes)).fly(lambda topic, record: records.setdefault(topic, []).append(record))
    true = [(truth.chief_state, truth.deputies[0]) for truth in records["/truth"]]
    forces = np.array([thrust.force for thrust in records["/deputy1/thrust"]])
    mass = np.array([each.mass for _, each in true])
    tilt = plant.chief.inclination
    across = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(tilt), np.sin(tilt)]])
    return Flight(
        1e-9 * np.array([truth.time for truth in records["/truth"]]),
        np.array([each.inertial_state[:3] for _, each in true]) @ across.T,
        np.array([chief[:3] for chief, _ in true]) @ across.T,
        np.array([np.linalg.norm(each.relative_state[:3]) for _, each in true]),
        forces / mass[: len(forces), None],
        float(np.abs(forces).max()),
        float(mass[0] - mass[-1]),
        len({status.fallback for status in records["/deputy1/status"]} - {""}),
    )


def section(directory: Path) -> tuple[str, list[Figure]]:
    """The flights, and what the frame does to the plan."""
    return joined(directory, constellation, frames)


def constellation(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Six slots, and the first once more from a start that is off."""
    flights = {f"{slot + 1}": fly(slot) for slot in range(SLOTS)}
    flights["1, off at the start"] = fly(0, OFF)
    best = optimum(FIRST, 0.0)
    lines = [
        "## Owis: a constellation flown",
        "",
        f"`formation-gnc sil gnss_raising`: six satellites of one plane at {GNSS / 1e3:g} km, raised to",
        f"{HIGH / 1e3:g} km in {FINAL:g} s (4.469 canonical units) over half a turn, as in the first transfer;",
        "1000 kg, specific impulse 300 s, J2 to J4, Sun and Moon, on estimates from positions (1 m) and velocities",
        "(1 mm/s) each minute. The law `asre`, Q = 0, plans 400 steps from the estimate every 1800 s, the last 1800 s",
        "before the end. What differs from the document: the state is that relative to the slot, in the Hill frame",
        "that goes with the slot, 9200 km off at the start, not polar coordinates about the Earth; so each slot of the",
        "plane is a flight of its own, whose plans know of no other. Supervision is off: its dead reckoning adds",
        "thrust by Hill's equations, which do not hold that far out. J is that of the thrust flown, over the optimum",
        "of the two-body problem. *Off at the start*: by 0.01 in every canonical unit, 376 km and 55 m/s, outwards and",
        "ahead: less is left to be done, and J is over the optimum of the others. Thrust and delta-v are what the time",
        "asks for, far from low thrust.",
        "",
        "| slot | delta-v, m/s | propellant, kg | largest force on an axis, N | J over the optimum "
        "| error at the final time, m | greatest in the hour after, m |",
        "|---|---|---|---|---|---|---|",
    ]
    plot = plt.figure(figsize=(16, 5.5))
    path, thrust, distance = plot.subplots(1, 3)
    for name, flight in flights.items():
        end = flight.arrival
        arrived = flight.error[end : end + round(3600.0 / flight.tick)].max()
        words = [
            ours(f"flown, {name}: delta-v", flight.delta_v, ".1f", "m/s"),
            ours(f"flown, {name}: propellant", flight.propellant, ".1f", "kg"),
            ours(f"flown, {name}: largest force", flight.force, ".1f", "N"),
            ours(f"flown, {name}: J over the optimum", flight.cost / best, ".4f"),
            ours(f"flown, {name}: error at the final time", flight.error[end], ".2f", "m", margin=0.1),
            ours(f"flown, {name}: greatest later", arrived, ".2f", "m", margin=0.1),
        ]
        lines.append(f"| {name} | {' | '.join(words)} |")
        hours = flight.times / 3600.0
        path.plot(*(flight.plane[: end + 1].T / 1e3))
        path.plot(*(flight.plane[end] / 1e3), "ko", ms=4)
        thrust.plot(hours[:-1], np.linalg.norm(flight.acceleration, axis=1)[: len(hours) - 1], lw=1.0, label=name)
        distance.semilogy(hours, flight.error, lw=1.0, label=name)
    turn = np.linspace(0.0, tau, 200)
    for radius in (GNSS, HIGH):
        path.plot(radius / 1e3 * np.cos(turn), radius / 1e3 * np.sin(turn), "k", lw=0.5)
    path.set(aspect="equal", xlabel="from the node, km", ylabel="across, km", title="Fig. 1: a constellation raised")
    thrust.set(xlabel="time, h", ylabel="acceleration by thrust, m/s²")
    distance.set(xlabel="time, h", ylabel="distance from the slot, m")
    distance.legend(fontsize=8, title="slot")
    save(plot, directory / "owis_raised.png")
    six = [flights[f"{slot + 1}"] for slot in range(SLOTS)]
    angles = np.unwrap([float(np.arctan2(*each.plane[each.arrival][::-1])) for each in six])
    apart = float(np.abs(np.degrees(np.diff(angles)) - 360.0 / SLOTS).max())
    lines += ["", "![The constellation flown](owis_raised.png)", ""]
    every, costliest = flights.values(), max(each.cost for each in six)
    return "\n".join(lines), [
        Figure(
            "constellation flown: greatest error at the final time",
            "0",
            max(float(each.error[each.arrival]) for each in every),
            "m",
            0.0,
            10.0,
        ),
        # Sun, Moon and J2 move the slots themselves, which fly freely: by kilometres in eight hours.
        Figure("constellation flown: largest angle between neighbours off 60 deg", "0", apart, "deg", 0.0, 0.05),
        Figure("constellation flown: greatest J over the optimum", "1", costliest / best, "", 1.0, 1.02),
        Figure("constellation flown: plans that failed", "0", sum(each.failures for each in every), "", 0, 0),
    ]


def frames(_: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """The same transfer planned in the Hill frame of a slot further back in the plane."""
    chief = Elements(HIGH, 0.0, 0.0, 0.0, 0.0, ARGUMENT)
    best = optimum(FIRST, 0.0)
    _path, about_earth = flown(FIRST, asre(FIRST, radial, 0.0).trajectory.inputs, 0.0)
    lines = [
        "## Owis: the frame of a plan",
        "",
        "The plan at the start (two bodies) in the Hill frame of another slot of the plane: the motion is the same,",
        "its factorisation is not. In polar coordinates about the Earth, with gravity in the column of r, J is",
        f"{ours('frames: J about the Earth', about_earth / best, '.3f')} of the optimum.",
        "",
        "| slots between the satellite's and the frame's | iterations | J over the optimum |",
        "|---|---|---|",
    ]
    ratios = []
    law = Asre.__new__(Asre)
    law.parameters = AsreParameters(max_iterations=60)
    for ahead in range(SLOTS):
        turn = tau * ahead / SLOTS
        low = state_from_elements(Elements(GNSS, 0.0, 0.0, 0.0, 0.0, 0.5 * pi + turn))
        start = relative_from_inertial(state_from_elements(chief), low)
        goal = np.array([HIGH * (np.cos(turn) - 1.0), HIGH * np.sin(turn), 0.0, 0.0, 0.0, 0.0])
        plan = law.plan(Task(PLAN_MODELS["nonlinear"](chief), 0.0, start, goal, FINAL, 400))
        ratios.append(0.5 * plan.cost / (MU / GNSS**2) ** 2 / UNIT / best)
        words = [
            ours(f"frames, {ahead}: iterations", plan.iterations, "d", margin=0.0),
            ours(f"frames, {ahead}: J over the optimum", ratios[-1], ".3f"),
        ]
        lines.append(f"| {ahead} | {' | '.join(words)} |")
    lines += ["", "So each satellite is flown about its own slot.", ""]
    return "\n".join(lines), [Figure("frames: J over the optimum about its own slot", "1", ratios[0], "", 1.0, 1.02)]
