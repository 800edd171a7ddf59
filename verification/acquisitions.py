"""Kremmydas' acquisitions: four satellites with 8 uN, dark in the real eclipses, over 100 orbits.

The flight software flies them (`netsat.yaml`): guidance gives targets and eclipses, MPC plans an orbit at a
time, thrusters reject to fire in the dark. Only estimates are the truth, and the truth is his at first:
Hill's equations.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from formation_gnc.common import CommonParameters
from formation_gnc.guidance.curvilinear import curvilinear_from_hill, hill_from_curvilinear
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.relative.hill import HillModel
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario
from verification.coverage.marker import covers
from verification.figure import TABLE, Figure, save
from verification.omniscient import Omniscient

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]

PAGE = "control"
"""Which shows what is flown here."""

NETSAT = Path(__file__).with_name("netsat.yaml")
MASS, LIMIT = 1.5, 8e-6
"""kg and N per axis, as there."""

ORBITS = 100
"""As long as it flies, there."""

AXES = ("radial", "along-track", "cross-track")


@dataclass(frozen=True)
class Acquisition:
    """One formation left for another."""

    left: str
    taken: str
    size: float
    """Along-track half axis of both, m."""
    step: float
    """Sampling time, s."""
    source: str
    out_of_reach: int
    """Places, of the fixed ones, to which no law comes in time."""
    over_least: float
    """Delta-v of all four over the least, with slots assigned, as it was when last looked at."""

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.left} to {self.taken}, {self.size:g} m".replace("_", " ")


ACQUISITIONS = (
    Acquisition("tetrahedral", "three_in_plane_one_out", 1000.0, 240.0, "Flown in 4.4", 0, 2.09),
    Acquisition("equidistant", "helix", 400.0, 80.0, "Set in the listing of the main function", 0, 1.79),
    Acquisition("three_in_plane_one_out", "equidistant", 1000.0, 240.0, "To be tested by 4.2", 1, 1.58),
    Acquisition("equidistant", "tetrahedral", 1000.0, 240.0, "To be tested by 4.2", 0, 1.66),
)


@dataclass(frozen=True)
class Setting:
    """How an acquisition is flown."""

    weight: float
    """Terminal weight; 1.7 is printed."""
    shared: bool = False
    """Whether order and phase are free for the least delta-v of the fleet (his 3.4)."""
    truth: str = ""
    """"two-body" or "J2" for two orbits, none for Hill's equations."""

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.weight:g}" + ", assigned" * self.shared + f", {self.truth} truth" * bool(self.truth)


PRINTED, FIXED = Setting(1.7), Setting(17.0)
SHARED, TWO_BODY, OBLATE = (Setting(17.0, shared=True, truth=truth) for truth in ("", "two-body", "J2"))
SETTINGS = (PRINTED, FIXED, SHARED, TWO_BODY, OBLATE)


def scenario(
    acquisition: Acquisition, setting: Setting, changes: Mapping[str, Mapping[str, Any]] | None = None
) -> Scenario:
    """All that flies, from the slots of the formation that is left, with changes of guidance and controller.

    Weights are those of the listing of netSATmpc, squared over scales of 4 m (along-track) and 2 m and their
    rates. A plan of an orbit, and a horizon of four thirds of one, both in whole steps.
    """
    step, rate = acquisition.step, load_scenario(str(NETSAT)).plant.mean_motion
    plan, horizon = (math.ceil(share * math.tau / rate / step) for share in (1.0, 4.0 / 3.0))
    oblate = setting.truth == "J2"
    common: dict[str, dict[str, Any]] = {
        "/**": {"tick": step},
        "/**/guidance": {
            "model": "j2_mean_motion" if oblate else "hill",
            f"{acquisition.left}.size": acquisition.size,
            f"{acquisition.taken}.size": acquisition.size,
        },
        "/**/controller": {
            "mpc.model": "schweighart_sedwick" if oblate else "hill",
            "mpc.step": step,
            "mpc.horizon": horizon,
            "mpc.control_horizon": plan,
            "mpc.replan_interval": plan * step,
            "mpc.position_error": [2.0 / setting.weight, 4.0 / setting.weight, 2.0 / setting.weight],
            "mpc.velocity_error": [0.002 / setting.weight, 0.004 / setting.weight, 0.002 / setting.weight],
        },
    }

    for node, values in (changes or {}).items():
        common[node] |= values

    def load(formation: str, plant: dict[str, Any], assignment: str) -> Scenario:
        guidance = common["/**/guidance"] | {"formation": formation, "assignment": assignment}
        return load_scenario(str(NETSAT), common | {"/plant": plant, "/**/guidance": guidance})

    starts: dict[str, Any] = {
        f"{name}.relative_state": Guidance(f"/{name}/guidance", setup["guidance"])
        .configuration.design.states(np.zeros(1))[0]
        .tolist()
        for name, setup in load(acquisition.left, {}, "fixed").deputies.items()
    }
    if setting.truth == "two-body":
        starts["forces.zonal_degree"] = 0
    return load(acquisition.taken, starts, "delta_v" if setting.shared else "fixed")


class HillTruth(Propagator):
    """The chief under J2; the others by Hill's equations about it, in the coordinates of targets: curvilinear ones.

    Thrust is held along its axes.
    """

    def __init__(self, common: CommonParameters) -> None:
        """For the common's orbit and tick."""
        super().__init__(common.tick, math.ceil(common.tick / 10.0), epoch=common.epoch)
        self._model = HillModel(common.mean_motion)

    def propagate_with_thrust(self, time: float, states: Array, forces: Array, masses: Array) -> Array:
        """States one tick later."""
        chief = self.propagate(time, states[:1], np.zeros((1, 3)))[0]
        now = np.zeros(len(states) - 1)
        before = np.array([relative_from_inertial(states[0], state) for state in states[1:]])
        before = curvilinear_from_hill(before, states[0], now, MU)
        moved = [
            self._model.propagate(0.0, state, self._tick, force / mass)
            for state, force, mass in zip(before, forces[1:], masses[1:], strict=True)
        ]
        after = hill_from_curvilinear(np.array(moved), chief, now, MU)
        return np.array([chief, *(inertial_from_relative(chief, each) for each in after)])


@dataclass(frozen=True)
class Flight:
    """What flew, of all four satellites."""

    common: CommonParameters
    states: Array
    """(4, N, 6)"""
    targets: Array
    """(4, N, 6)"""
    forces: Array
    """(4, N, 3), as commanded, N"""
    dark: NDArray[np.bool_]
    """(N,) whether any of the Sun is hidden at a tick."""
    fallbacks: int

    @property
    def shaded(self) -> NDArray[np.bool_]:
        """(N,) ticks that meet an eclipse, each of which is longer than a tick."""
        return self.dark | np.append(self.dark[1:], False)

    @property
    def broken(self) -> float:
        """Share of the ticks with force that meet an eclipse."""
        return float(np.mean(self.shaded & self.forces.any(axis=(0, 2))))

    @cached_property
    def errors(self) -> Array:
        """(4, N) distance from the target, m."""
        distances: Array = np.linalg.norm((self.states - self.targets)[:, :, :3], axis=2)
        return distances

    @property
    def delta_v(self) -> Array:
        """(4,) sum over the axes, m/s."""
        spent: Array = np.abs(self.forces).sum(axis=(1, 2)) * self.common.tick / MASS
        return spent

    def worst(self, orbit: int) -> Array:
        """(4,) largest error in an orbit, from 1, m."""
        ticks = math.tau / self.common.mean_motion / self.common.tick
        part: Array = self.errors[:, round((orbit - 1) * ticks) : round(orbit * ticks)].max(axis=1)
        return part

    def least(self, satellite: int) -> float:
        """Delta-v, m/s, without which no law comes to the target in this time with these eclipses."""
        return least_delta_v(
            HillModel(self.common.mean_motion),
            self.states[satellite, 0],
            self.targets[satellite, -1],
            self.common.tick,
            ~self.shaded[:-1],
            LIMIT / MASS,
        )


def fly(acquisition: Acquisition, setting: Setting) -> Flight:
    """One acquisition, to the end."""
    flown = scenario(acquisition, setting)
    run = Run(flown)
    if not setting.truth:
        run.plant._propagator = HillTruth(flown.plant)
    for name in run.plant.parameters.deputies:
        run.instances[f"/{name}/navigation"].module = Omniscient(run.plant, name)
    records: dict[str, list[Any]] = {}
    run.fly(lambda topic, record: records.setdefault(topic, []).append(record))
    names = run.plant.parameters.deputies
    return Flight(
        flown.plant,
        np.array([[truth.deputies[index].relative_state for truth in records["/truth"]] for index in range(4)]),
        np.array([[target.relative_state for target in records[f"/{name}/target"]] for name in names]),
        np.array([[thrust.force for thrust in records[f"/{name}/thrust"]] for name in names]),
        np.array([any(each.eclipse for each in truth.deputies) for truth in records["/truth"]]),
        sum(bool(status.fallback) for name in names for status in records[f"/{name}/status"]),
    )


def least_delta_v(
    model: HillModel, start: Array, goal: Array, step: float, light: NDArray[np.bool_], limit: float
) -> float:
    """Least delta-v (m/s, sum over the axes) from one state to another, on Hill's model.

    Args:
        model: the motion.
        start: (6,) state at the start.
        goal: (6,) state after all steps.
        step: s, over which an acceleration is held.
        light: (N,) of each step, whether there is thrust in it.
        limit: of the acceleration per axis, m/s^2.

    Returns:
        Infinity where no thrust within the limit does it.
    """
    phi, gamma = model.discretise(0.0, step)
    unit = np.repeat([1.0, model.mean_motion], 3)
    columns, response = [], gamma / unit[:, None]
    backwards = phi * (unit / unit[:, None])
    for lit in light[::-1]:
        if lit:
            columns.append(response)
        response = backwards @ response
    to_go = (goal - model.transition(0.0, step * len(light)) @ start) / unit
    scale = np.abs(to_go).max()
    forced = np.hstack(columns) * model.mean_motion**2
    found = linprog(
        np.ones(2 * forced.shape[1]),
        A_eq=np.hstack([forced, -forced]),
        b_eq=to_go / scale,
        bounds=(0.0, limit / (scale * model.mean_motion**2)),
    )
    return float(found.fun) * scale * model.mean_motion**2 * step if found.success else math.inf


HEADING = f"""## Kremmydas, acquisitions of four satellites

{MASS:g} kg and {LIMIT * 1e6:g} uN per axis at 700 km, {ORBITS} orbits (6.9 days), by the flight software
but for navigation. One plan an orbit by MPC, with terminal weights. The document prints no error and no
delta-v, and of its plots only the titles are left: what can be set beside ours is what it flies with, and
that it means to arrive "in the magnitude of days".

| | printed | ours | why |
|---|---|---|---|"""

DIFFERENCES = (
    (
        "orbital rate, rad/s",
        "1.127e-6 (4.1), 1.0618e-3 (listing)",
        "1.0602e-3",
        "4.1 has no rate of an orbit; the listing counts 700 km from the mean radius",
    ),
    (
        "thrust and mass",
        "5.33 uN, 1.3 kg (text); 8e-6 / 1.5 m/s^2 (listing)",
        "8 uN, 1.5 kg",
        "5.33e-6 is the listing's acceleration, not a force",
    ),
    (
        "dark",
        "the last 8 of the 25 steps of a plan",
        "every step that meets an eclipse of the orbit flown",
        "his plan of 6000 s is longer than the orbit: his night goes round it in 70 orbits",
    ),
    (
        "steps with thrust",
        "18, none after them",
        "all of a plan, 25 (74 of 80 s), but for the dark",
        "the windows themselves are dark now",
    ),
    ("horizon", "two orbits (text), 33 steps (listing)", "33 steps, 99 of 80 s: 1.34 orbits", "as flown"),
    (
        "target",
        "that of now",
        "carried to the horizon's end",
        "where the error is weighted: else he lags by a third of an orbit",
    ),
    ("terminal weight", "1.7", "1.7 and 17", "see below"),
    (
        "order and phase",
        "fixed; free in 3.4",
        "both",
        "assigned: as guidance finds them for the least sum of delta-v",
    ),
)

CONCLUSION = """
Error is the largest in an orbit. Delta-v is the sum over the axes; the least is what no law can do
without from that start to that target through these nights, on Hill's equations (a linear programme):
none where 8 uN are not enough.

No thrust meets an eclipse that comes as foreseen; that steps are dark as a whole takes {lost:.0f} % of
the orbit besides the night. The printed weight leaves hundreds of metres after 100 orbits, and with steps
of 80 s, of which three times as many are to be paid for, it hardly moves at all. Ten times the weight
brings all home whose slots can be reached; that of the fourth satellite on the way to equidistant
cannot, by any law. With order and phase assigned all arrive, and spend less. What MPC spends over the
least it pays for being early, since the least takes all of the time, and for a cost that is quadratic in
thrust.

On the truth of two orbits about a point mass some metres remain of what Hill's equations leave out, and
under J2 tens. A formation of a kilometre is pulled apart by metres in an orbit then, which neither its target
nor a plan that is made once an orbit foresees; that plans are made on Schweighart and Sedwick's model helps
no more than Hill's would.
"""

TOLERANCE = 0.05
"""Of delta-v over the least, relative: far above the solver's accuracy of 1e-4, below what a change of law or
eclipses does."""


covers(
    "Kremmydas 4.3.2",
    "control/mpc.py",
    figures=(
        "tetrahedral to three in plane one out, 1.7: worst error",
        "tetrahedral to three in plane one out, 17: worst error of the others",
    ),
    differs=(
        "all steps of a plan may thrust, but for the eclipse; with the printed weight hundreds of metres "
        "are left, with ten times that none; the document prints no error"
    ),
)
covers(
    "Kremmydas Fig. 4.13; Fig. 4.14",
    "control/mpc.py",
    figures=("tetrahedral to three in plane one out, 1.7: worst error",),
    differs="the plot is lost in the text; ours is control_kremmydas_thrust.png",
)
covers(
    "Kremmydas Listing: main function; Listing: controller call (MPC wrapper)",
    "guidance/guidance.py",
    "control/mpc.py",
    figures=("equidistant to helix, 1.7: worst error",),
    differs="its acquisition flown by the flight software; the listing prints no result",
)
covers(
    "Kremmydas Listing: main function for perpetual control; Listing: ctrl_mpc_transfer_hill",
    "control/mpc.py",
    figures=("three in plane one out to equidistant, 1.7: worst error",),
    differs="plan after plan, each an orbit; the listing prints no result",
)
covers(
    "Kremmydas Fig. 1.1; Fig. 1.2; Fig. 1.3; Fig. 1.4; Fig. 1.5; Fig. 1.6; Fig. 1.7",
    impossible="a drawing, with nothing to compute",
)


def kremmydas(directory: Path) -> tuple[str, list[Figure]]:
    """All acquisitions in all settings."""
    flights = {pair: fly(*pair) for pair in product(ACQUISITIONS, SETTINGS)}
    lines: list[str] = [HEADING, *(f"| {' | '.join(row)} |" for row in DIFFERENCES), ""]
    figures: list[Figure] = []
    for acquisition in ACQUISITIONS:
        lines += [
            f"### {acquisition.name}",
            "",
            f"{acquisition.source}; steps of {acquisition.step:g} s.",
            "",
            "| weight | satellite | start, m | orbit 50 | orbit 100 | 10 m at orbit | mm/s | least |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for setting in SETTINGS:
            lines += rows(setting, flights[acquisition, setting])
        lines.append("")
        figures += guard(acquisition, {setting: flights[acquisition, setting] for setting in SETTINGS})
    some = flights[ACQUISITIONS[0], FIXED]
    lines.append(CONCLUSION.format(lost=100.0 * (some.shaded.mean() - some.dark.mean())))
    every = flights.values()
    figures += [
        # Nothing else is allowed: the windows are hard, and so is the limit.
        Figure(
            "largest force in a step that meets an eclipse",
            "0",
            max(largest(flight, True) for (_, each), flight in flights.items() if each != TWO_BODY),
            "uN",
            0.0,
            0.0,
        ),
        # Guidance foresees eclipses under J2, an orbit ahead or two; about a point mass some 3 s off.
        # With two edges in an orbit of 74 steps of 80 s that is 0.1 % of the steps.
        Figure(
            "two-body truth: steps with force that meet an eclipse",
            "0",
            100.0 * max(flights[each, TWO_BODY].broken for each in ACQUISITIONS),
            "%",
            0.0,
            0.2,
        ),
        Figure("largest force", "8 uN", max(largest(each, False) for each in every), "uN", 7.99, 8.0 + 1e-9),
        Figure("ticks without an answer of the solver", "0", sum(each.fallbacks for each in every), "", 0, 0),
        # A shadow's width, asin(6378 / 7078) / pi = 0.357, and the penumbra.
        Figure("share of the orbit that is dark", "1/3", some.dark.mean(), "", 0.355, 0.362),
    ]
    draw_errors(flights, directory / "control_kremmydas.png")
    draw_thrust(flights, directory / "control_kremmydas_thrust.png")
    lines += [
        TABLE,
        *(figure.row for figure in figures),
        "",
        "![Errors](control_kremmydas.png)",
        "",
        "Weight 17, assigned: the first three orbits; eclipses are shaded.",
        "",
        "![Thrust](control_kremmydas_thrust.png)",
        "",
    ]
    return "\n".join(lines), figures


def rows(setting: Setting, flight: Flight) -> list[str]:
    """Lines of the table, one for each satellite."""
    lines = []
    for index, errors in enumerate(flight.errors):
        far = np.flatnonzero(errors > 10.0)[-1] + 1
        arrived = "no" if far == len(errors) else f"{math.ceil(far * ORBITS / len(errors))}"
        late = [flight.worst(orbit)[index] for orbit in (50, 100)]
        least = "" if setting.truth else f"{1e3 * flight.least(index):.1f}".replace("inf", "none")
        cells = [
            setting.name,
            f"{index + 1}",
            f"{errors[0]:.0f}",
            *(f"{each:.3g}" if each > 1e-3 else "< 0.001" for each in late),
            arrived,
            f"{1e3 * flight.delta_v[index]:.1f}",
            least,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def largest(flight: Flight, in_eclipse: bool) -> float:
    """Largest force per axis, uN."""
    forces = flight.forces[:, flight.shaded] if in_eclipse else flight.forces
    return 1e6 * float(np.abs(forces).max())


def guard(acquisition: Acquisition, flights: Mapping[Setting, Flight]) -> list[Figure]:
    """Its figures."""
    name = f"{acquisition.left} to {acquisition.taken}".replace("_", " ")
    reachable = np.array([math.isfinite(flights[FIXED].least(index)) for index in range(4)])
    shared, two_body, oblate = flights[SHARED], flights[TWO_BODY], flights[OBLATE]
    over = shared.delta_v.sum() / sum(shared.least(index) for index in range(4))
    usual = acquisition.over_least
    return [
        # Tens to hundreds of metres: the weight pays for no more.
        Figure(f"{name}, 1.7: worst error", "not printed", flights[PRINTED].worst(100).max(), "m", 10.0, 1000.0),
        Figure(
            f"{name}: slots out of reach",
            "not printed",
            np.sum(~reachable),
            "",
            *[acquisition.out_of_reach] * 2,
        ),
        # Arrived: what is left of a kilometre in the last orbits is on its way down still.
        Figure(
            f"{name}, 17: worst error of the others",
            "not printed",
            flights[FIXED].worst(100)[reachable].max(),
            "m",
            0.0,
            10.0,
        ),
        Figure(f"{name}, assigned: worst error", "not printed", shared.worst(100).max(), "m", 0.0, 0.01),
        Figure(
            f"{name}, assigned: delta-v over the least",
            "not printed",
            over,
            "",
            (1.0 - TOLERANCE) * usual,
            (1.0 + TOLERANCE) * usual,
        ),
        # A kilometre squared over the orbit's radius, 0.14 m, and the drift that it grows to over a plan.
        Figure(f"{name}, two-body truth: worst error", "not printed", two_body.worst(100).max(), "m", 0.0, 10.0),
        # Metres an orbit, met once an orbit: tens.
        Figure(f"{name}, J2 truth: worst error", "not printed", oblate.worst(100).max(), "m", 0.0, 40.0),
        # Differential J2 pulls a kilometre apart by some 0.1 m/s a day across the track, in the worst phase.
        Figure(
            f"{name}, J2 truth: delta-v over that on Hill's",
            "not printed",
            oblate.delta_v.sum() / shared.delta_v.sum(),
            "",
            1.0,
            1.3,
        ),
    ]


def draw_errors(flights: Mapping[tuple[Acquisition, Setting], Flight], path: Path) -> None:
    """Largest position error in every orbit: a row for each acquisition, a column for each setting."""
    plot, panels = plt.subplots(4, 5, figsize=(19, 13), sharex=True, sharey=True)
    for panel, ((acquisition, setting), flight) in zip(panels.flat, flights.items(), strict=True):
        orbits = np.arange(1, ORBITS + 1)
        worst = np.array([flight.worst(int(orbit)) for orbit in orbits])
        panel.semilogy(orbits, worst, label=[f"satellite {index + 1}" for index in range(4)])
        panel.set(title=f"{acquisition.name}\nweight {setting.name}", ylim=(1e-3, 1e4))
    for panel in panels[-1]:
        panel.set_xlabel("orbits")
    for panel in panels[:, 0]:
        panel.set_ylabel("position error, m")
    panels[0, 0].legend()
    save(plot, path)


def draw_thrust(flights: Mapping[tuple[Acquisition, Setting], Flight], path: Path) -> None:
    """Thrust in the first three orbits: a row for each acquisition, a column for each satellite."""
    plot, panels = plt.subplots(4, 4, figsize=(17, 12), sharex=True, sharey=True)
    for row, acquisition in zip(panels, ACQUISITIONS, strict=True):
        flight = flights[acquisition, SHARED]
        count = 3 * flight.errors.shape[1] // ORBITS
        orbits = np.arange(count) * flight.common.tick * flight.common.mean_motion / math.tau
        for index, panel in enumerate(row):
            panel.fill_between(orbits, -9.0, 9.0, where=flight.dark[:count], color="0.85", step="post", lw=0.0)
            panel.step(orbits, 1e6 * flight.forces[index, :count], where="post", label=AXES)
            panel.set(title=f"{acquisition.name}\nsatellite {index + 1}", ylim=(-9.0, 9.0))
        row[0].set_ylabel("force, uN")
    for panel in panels[-1]:
        panel.set_xlabel("orbits")
    panels[0, 0].legend(loc="lower left")
    save(plot, path)
