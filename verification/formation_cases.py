"""Basilisk's formation cases by its laws and by ours, side by side."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements, true_from_mean_anomaly
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import hill_rotation, relative_from_inertial
from formation_gnc.orbit.mean import mean_elements, osculating_elements
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.parameters import load
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS
from verification.basilisk_formations import MASS, Flown, fed_back, reconfigured
from verification.figure import Figure

Array = NDArray[np.float64]

NAMES = ("da / a", "de", "di", "dOmega", "domega", "dM")
E4 = 1e4


@dataclass(frozen=True)
class Case:
    """From some differences of the classical elements to others, of mean orbits if there is J2."""

    name: str
    chief: tuple[float, ...]
    """Semi-major axis (m), eccentricity, inclination, node, argument of perigee and mean anomaly (deg)."""
    start: tuple[float, ...]
    """1e-4, osculating."""
    goal: tuple[float, ...]
    """1e-4"""
    revolutions: float
    zonal_degree: int
    limit: float
    """N, on the magnitude."""
    tick: float
    """Of our laws, s."""
    laws: dict[str, dict[str, Any]]
    """Ours, with their parameters; times of `convex` in revolutions."""

    @property
    def orbit(self) -> Elements:
        """The chief at the start."""
        a, e, *angles = self.chief
        i, node, perigee, anomaly = np.radians(angles).tolist()
        return Elements(a, e, i, node, perigee, true_from_mean_anomaly(anomaly, e))

    @property
    def duration(self) -> float:
        """s"""
        return self.revolutions * self.orbit.period

    def states(self) -> Array:
        """(2, 6) of chief and deputy at the start, inertial."""
        return np.array([state_from_elements(each) for each in (self.orbit, changed(self.orbit, self.start))])

    def target(self, chief: Array) -> Array:
        """(6,) relative state that has the differences to reach, about an inertial state."""
        orbit = elements_from_state(chief)
        if not self.zonal_degree:
            aim = changed(orbit, self.goal)
        else:
            aim = osculating_elements(changed(mean_elements(orbit), self.goal))
        return np.asarray(relative_from_inertial(chief, state_from_elements(aim)))

    def differences(self, chief: Array, deputy: Array) -> Array:
        """(6,) of the classical elements, 1e-4."""
        one, other = (elements_from_state(each) for each in (chief, deputy))
        if self.zonal_degree:
            one, other = mean_elements(one), mean_elements(other)
        found = [
            (other.semi_major_axis - one.semi_major_axis) / one.semi_major_axis,
            other.eccentricity - one.eccentricity,
            *(
                math.remainder(getattr(other, name) - getattr(one, name), math.tau)
                for name in ("inclination", "right_ascension", "argument_of_perigee", "mean_anomaly")
            ),
        ]
        return E4 * np.array(found)


def changed(orbit: Elements, differences: tuple[float, ...]) -> Elements:
    """Elements with differences of [a / a, e, i, node, perigee, mean anomaly], 1e-4."""
    da, de, di, node, perigee, anomaly = np.array(differences) / E4
    eccentricity = orbit.eccentricity + de
    return replace(
        orbit,
        semi_major_axis=orbit.semi_major_axis * (1.0 + da),
        eccentricity=eccentricity,
        inclination=orbit.inclination + di,
        right_ascension=orbit.right_ascension + node,
        argument_of_perigee=orbit.argument_of_perigee + perigee,
        true_anomaly=true_from_mean_anomaly(orbit.mean_anomaly + anomaly, eccentricity),
    )


CASES = (
    Case(
        "spacecraftReconfig",
        (11e6, 0.4, 60.0, 90.0, 60.0, 40.0),
        (3.0, -2.0, 1.0, 4.0, -1.0, 2.0),
        (0.0, 1.0, 2.0, -1.0, -2.0, -3.0),
        1.1,
        0,
        22.0,
        10.0,
        {
            "convex": {
                "model": "tschauner_hempel",
                "final_time": 1.1,
                "replan_interval": 0.1,
                "last_plan": 0.1,
                "step": 30.0,
            }
        },
    ),
    Case(
        "meanOEFeedback",
        (11e6, 0.4, 10.0, 0.0, 70.0, 0.0),
        (1.0, 2.0, -3.0, 4.0, 5.0, 6.0),
        (0.0, 0.0, 0.0, 3.0, 2.0, 1.0),
        40.0,
        2,
        1.7,
        60.0,
        {
            "convex": {
                "model": "relative_elements",
                "final_time": 10.0,
                "replan_interval": 1.0,
                "holding_time": 1.0,
                "step": 180.0,
            },
        },
    ),
)


def flown_by(case: Case, law: str) -> Flown:
    """A case by a law of ours, on the plant's own propagator with perfect knowledge."""
    own = dict(case.laws[law])
    for name in ("final_time", "holding_time", "replan_interval", "last_plan"):
        if law == "convex" and name in own:
            own[name] = round(own[name] * case.orbit.period / own["step"]) * own["step"]
    limit = case.limit / math.sqrt(3.0)
    if law == "convex":
        own["total_thrust"] = limit = case.limit
    values = {f"chief.{name}": value for name, value in vars(case.orbit).items()} | {"tick": case.tick}
    values |= {f"{law}.{name}": value for name, value in own.items()}
    values |= {"algorithm": law, "mass": MASS, "thrust_limit": (limit,) * 3}
    manager = ControllerManager("/deputy1/controller", load(ControllerParameters, values))
    truth = Propagator(case.tick, math.ceil(case.tick / 10.0), Forces(zonal_degree=case.zonal_degree))
    states, spent, largest = case.states(), 0.0, 0.0
    for k in range(round(case.duration / case.tick)):
        chief, time = states[0], round(k * case.tick * NANOSECONDS)
        seen = NavigationState(time, relative_from_inertial(chief, states[1]), chief, MASS)
        aim = Target(time, "given", case.target(chief), NANOSECONDS, np.empty((0, 6)))
        thrust, status = manager.on_tick(seen, aim)
        if status.fallback:
            raise RuntimeError(status.fallback)
        size = float(np.linalg.norm(thrust.force))
        spent, largest = spent + size / MASS * case.tick, max(largest, size)
        push = hill_rotation(chief).T @ thrust.force / MASS
        states = truth.propagate(k * case.tick, states, np.stack([np.zeros(3), push]))
    return Flown(states[0], states[1], spent, largest)


def theirs(case: Case) -> Flown:
    """A case by Basilisk's law, in Basilisk."""
    goal = [each / E4 for each in case.goal]
    if case.zonal_degree:
        return fed_back(case.states(), goal, case.duration, 15.0)
    return reconfigured(case.states(), goal, case.duration)


def miss(case: Case, flown: Flown) -> float:
    """Largest difference of an element from that to reach, times the semi-major axis, m."""
    off = case.differences(flown.chief, flown.deputy) - case.goal
    return float(np.abs(off).max()) / E4 * case.orbit.semi_major_axis


def formations() -> tuple[str, list[Figure]]:
    """Both cases by all laws."""
    head = f"| case | law | delta-v, m/s | largest force, N | miss, m | {' | '.join(NAMES)} |"
    lines, figures = [head, "|---" * (5 + len(NAMES)) + "|"], list[Figure]()
    for case in CASES:
        flown = {"Basilisk": theirs(case), **{law: flown_by(case, law) for law in case.laws}}
        for law, each in flown.items():
            cells = [case.name, law, f"{each.delta_v:.4g}", f"{each.largest:.3g}", f"{miss(case, each):.3g}"]
            cells += [f"{value:.4f}" for value in case.differences(each.chief, each.deputy)]
            lines.append(f"| {' | '.join(cells)} |")
        lines.append(f"| | to reach | | | | {' | '.join(f'{value:g}' for value in case.goal)} |")
        spent, off = flown["Basilisk"].delta_v, miss(case, flown["Basilisk"])
        for law in case.laws:
            ours, ratio = flown[law], flown[law].delta_v / spent
            name = f"{case.name}: {law}"
            figures.append(Figure(f"{name}, delta-v over Basilisk's", "no worse", ratio, "", 0.0, 1.0))
            figures.append(Figure(f"{name}, miss over Basilisk's", "no worse", miss(case, ours) / off, "", 0.0, 1.0))
    table = "\n".join(lines)
    text = f"""## Basilisk's formation laws

Two examples of Basilisk, flown in the same run by Basilisk itself (2 s and 15 s steps, its attitude control, its
thrusters) and by our laws on our plant's propagator (ticks of {CASES[0].tick:g} and {CASES[1].tick:g} s), from the
same states with perfect knowledge; 500 kg, a = 11000 km, e = 0.4.

- `spacecraftReconfig`, about a point mass: i = 60 deg, node 90 deg, perigee 60 deg, mean anomaly 40 deg, 1.1 orbits.
  It has two thrusters of 22 N side by side; ours is held to 22 N.
- `meanOEFeedback`, with J2: i = 10 deg, node 0, perigee 70 deg, mean anomaly 0, 40 orbits; classical elements,
  K = 1e7. Ours is held to 1.7 N, the largest force of theirs.

Differences of the classical elements from the chief's in 1e-4, of mean orbits (ours, `orbit/mean.py`, for all) where
there is J2; delta-v is the integral of the magnitude; the miss is the largest difference of an element from that to
reach, times a. Basilisk steers mean elements by a map of its own, of first order, so that some of its miss of a metre
is between the maps.

{table}

`impulsive` is not beside them: it takes no horizon of less than 1.5 orbits, and was not flown over the 40 of the
second.
"""
    return text, figures
