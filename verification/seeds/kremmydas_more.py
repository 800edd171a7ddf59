"""Kremmydas: types of acquisition, thrust polynomials, freedoms of a formation, held offsets, and Figs. 4.4 to 4.12."""

import math
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.optimize import linprog

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.riccati import Weights, continuous_gain
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS
from verification.acquisitions import ACQUISITIONS, FIXED, LIMIT, MASS, PRINTED, Flight, fly, scenario
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours, joined

PAGE = "kremmydas"

Array = NDArray[np.float64]

CHIEF = Orbit(7078137.0, inclination=1.7104)
COMMON = CommonParameters(CHIEF, tick=240.0)
HILL = HillModel(COMMON.mean_motion)
RATE, PERIOD = HILL.mean_motion, math.tau / HILL.mean_motion
STEP = PERIOD / 25.0
UNIT = np.repeat([1.0, RATE], 3)
"""Of states, and its square rate of accelerations: metres."""
START = np.array([250.0, 0.0, 100.0, 0.0, -500.0 * RATE, 0.0])
PLACE = np.array([200.0, 600.0, 80.0])
"""m; radial, along-track, cross-track, to be reached."""
AMPLE = 4.0 * LIMIT / MASS
"""m/s^2; four thrusters, so that an acquisition fits into ten orbits."""


def response(steps: int, step: float = STEP) -> tuple[Array, Array]:
    """Phi (6, 6) over all steps and the (6, 3 N) map of held accelerations, in `UNIT` and RATE^2."""
    phi, gamma = HILL.discretise(0.0, step)
    columns, one = [], gamma / UNIT[:, None] * RATE**2
    for _ in range(steps):
        columns.append(one)
        one = phi * UNIT / UNIT[:, None] @ one
    whole = HILL.transition(0.0, step * steps) * UNIT / UNIT[:, None]
    return whole, np.hstack(columns[::-1])


def least(
    start: Array,
    rows: Array,
    values: Array,
    steps: int,
    limits: float | Array,
    box: tuple[Array, Array] | None = None,
) -> tuple[float, Array]:
    """Least delta-v, m/s, and accelerations (N, 3), m/s^2, to an end state with rows x = values, abs(A x) <= b.

    Rows, values and box are of states in `UNIT`; limits, m/s^2, of each step, or one for all. Infinite if out of reach.
    """
    whole, forced = response(steps)
    free = whole @ (start / UNIT)
    scale = 1e3
    upper = np.repeat(np.broadcast_to(np.asarray(limits, dtype=float), (steps,)), 3) / RATE**2 / scale
    inequality, bounds = None, None
    if box is not None:
        matrix, size = box
        ahead = matrix @ forced
        inequality = np.vstack([np.hstack([ahead, -ahead]), np.hstack([-ahead, ahead])])
        bounds = np.concatenate([size - matrix @ free, size + matrix @ free]) / scale
    own = rows @ forced
    found = linprog(
        np.ones(6 * steps),
        A_eq=np.hstack([own, -own]),
        b_eq=(values - rows @ free) / scale,
        A_ub=inequality,
        b_ub=bounds,
        bounds=[(0.0, each) for each in np.tile(upper, 2)],
    )
    if not found.success:
        return math.inf, np.empty((0, 3))
    pushed = (found.x[: 3 * steps] - found.x[3 * steps :]).reshape(-1, 3) * scale * RATE**2
    return float(np.abs(pushed).sum()) * STEP, pushed


covers(
    "Kremmydas 3.2, simple",
    figures=(
        "types: delta-v with the end velocity free, over a formation's",
        "types: distance an orbit after a simple acquisition",
    ),
    differs="planned, not flown: the least delta-v on Hill's equations; guidance has no such target",
)
covers(
    "Kremmydas 3.2, drift-free; 3.3",
    figures=("types: drift-free over simple", "types: distance an orbit after a drift-free acquisition"),
    differs="planned, not flown: the least delta-v on Hill's equations; guidance has no such target",
)
covers(
    "Kremmydas 3.2, constrained drift-free",
    figures=("types: constrained over drift-free", "types: largest excursion over the box, constrained"),
    differs="planned, not flown: the least delta-v on Hill's equations; guidance has no such target",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """All parts."""
    return joined(directory, types, polynomials, freedoms, held, crossed, acquisition)


def types(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """The types of 3.2: what is asked of the velocity at the end."""
    steps = 250
    position, still = np.eye(3, 6), np.array([[2.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
    phases = np.linspace(0.0, PERIOD, 24, endpoint=False)
    later = np.vstack([(HILL.transition(0.0, float(time)) * UNIT / UNIT[:, None])[:3] for time in phases])
    sizes = np.tile([280.0, 800.0, 90.0], len(phases))
    ellipse = np.concatenate([PLACE, [300.0, -400.0, 0.0]])
    asked = {
        "simple": least(START, position, PLACE, steps, AMPLE),
        "drift-free": least(START, np.vstack([position, still]), np.append(PLACE, 0.0), steps, AMPLE),
        "constrained drift-free": least(
            START, np.vstack([position, still]), np.append(PLACE, 0.0), steps, AMPLE, (later, sizes)
        ),
        "force-free formation": least(START, np.eye(6), ellipse, steps, AMPLE),
    }
    whole, forced = response(steps)
    lines = [
        "## Types of acquisition (3.2)",
        "",
        "From a free ellipse of 500 m about the chief to a place 600 m ahead, 200 m out and 80 m across, in ten",
        "orbits by",
        "32 uN an axis on 1.5 kg:",
        "the least delta-v (a linear programme on Hill's equations), and the free motion of an orbit after it.",
        "Constrained:",
        "within 280, 800 and 90 m of the chief from then on. The formation is the ellipse about the chief",
        "through the place.",
        "",
        "| type | delta-v, mm/s | distance from the place an orbit later, m | largest radial, along-track, "
        "cross-track, m |",
        "|---|---|---|---|",
    ]
    costs, gone, reach = {}, {}, {}
    for name, (spent, pushed) in asked.items():
        end = whole @ (START / UNIT) + forced @ (pushed / RATE**2).ravel()
        motion = (later @ end).reshape(-1, 3)
        after = (HILL.transition(0.0, PERIOD) * UNIT / UNIT[:, None] @ end)[:3]
        costs[name], gone[name] = 1e3 * spent, float(np.linalg.norm(after - PLACE))
        reach[name] = np.abs(motion).max(axis=0)
        words = [
            ours(f"types, {name}: delta-v", costs[name], ".4g", "mm/s"),
            ours(f"types, {name}: an orbit later", gone[name], ".3g", "m", max(0.01 * gone[name], 0.1)),
            ", ".join(f"{each:.0f}" for each in reach[name]),
        ]
        lines.append(f"| {name} | " + " | ".join(words) + " |")
    lines.append("")
    return "\n".join(lines), [
        Figure(
            "types: delta-v with the end velocity free, over a formation's",
            "the minimum possible (at most 1)",
            costs["simple"] / costs["force-free formation"],
            "",
            0.0,
            1.0,
        ),
        Figure(
            "types: distance an orbit after a simple acquisition", "accumulated drift", gone["simple"], "m", 100.0, 1e5
        ),
        Figure(
            "types: drift-free over simple",
            "a subset (at least 1)",
            costs["drift-free"] / costs["simple"],
            "",
            1.0,
            10.0,
        ),
        Figure(
            "types: distance an orbit after a drift-free acquisition",
            "the same place (0)",
            gone["drift-free"],
            "m",
            0.0,
            0.1,
        ),
        Figure(
            "types: constrained over drift-free",
            "a subset (at least 1)",
            costs["constrained drift-free"] / costs["drift-free"],
            "",
            1.0,
            10.0,
        ),
        Figure(
            "types: largest excursion over the box, constrained",
            "confined (at most 1)",
            float((reach["constrained drift-free"] / sizes[:3]).max()),
            "",
            0.0,
            1.001,
        ),
    ]


covers(
    "Kremmydas 2.1, motion",
    figures=(
        "polynomial of the lowest order within reach: delta-v over the least",
        "polynomial of order 30: delta-v over the least",
    ),
    differs="the text gives no order and no figure",
)
covers(
    "Kremmydas 2.1, cost a F^2 + b F + c",
    "control/mpc.py",
    figures=("cost a F² + b F: delta-v with b alone over that with a alone",),
    differs="c changes no minimum; MPC has the two as its cost of thrust, quadratic or absolute; the text "
    "gives no a, b or c",
)


def polynomials(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """2.1: thrust as a polynomial of time, of least delta-v; and the cost a F^2 + b abs(F)."""
    steps = 50
    goal = np.array([0.0, 1000.0, 0.0, 500.0, 0.0, 0.0])
    limit = 40.0 * LIMIT / MASS
    whole, forced = response(steps)
    to_go = (goal - whole @ (START / UNIT)) / 1e3
    best, _ = least(START, np.eye(6), goal, steps, limit)
    lines = [
        "## Thrust as a polynomial of time (2.1)",
        "",
        "From the same ellipse to one of 1 km, in two orbits, 320 uN an axis: coefficients of the least delta-v",
        "for each order.",
        "",
        "| order | delta-v, mm/s | over the least of any thrust |",
        "|---|---|---|",
    ]
    shares = {}
    for order in (1, 2, 4, 8, 15, 30):
        basis = legvander(np.linspace(-1.0, 1.0, steps), order)
        profile = np.kron(basis, np.eye(3))
        count = profile.shape[1]
        eye = np.eye(3 * steps)
        found = linprog(
            np.concatenate([np.zeros(count), np.ones(3 * steps)]),
            A_eq=np.hstack([forced @ profile, np.zeros((6, 3 * steps))]),
            b_eq=to_go,
            A_ub=np.vstack([np.hstack([profile, -eye]), np.hstack([-profile, -eye])]),
            b_ub=np.zeros(6 * steps),
            bounds=[(None, None)] * count + [(0.0, limit / RATE**2 / 1e3)] * (3 * steps),
        )
        spent = float(found.fun) * 1e3 * RATE**2 * STEP if found.success else math.inf
        shares[order] = spent / best
        words = (
            [ours(f"polynomial {order}: delta-v", 1e3 * spent, ".4g", "mm/s"), f"{shares[order]:.3f}"]
            if found.success
            else ["out of reach", ""]
        )
        lines.append(f"| {order} | " + " | ".join(words) + " |")
    squared = np.linalg.pinv(forced) @ to_go * 1e3 * RATE**2
    quadratic = float(np.abs(squared).sum()) * STEP
    lines += [
        f"| any | {ours('polynomial, any: delta-v', 1e3 * best, '.4g', 'mm/s')} | 1 |",
        "",
        f"The cost of his footnote, a F² + b F + c, lies between its two ends: b alone is the least "
        f"delta-v, a alone takes "
        f"{ours('quadratic cost: delta-v', 1e3 * quadratic, '.4g', 'mm/s')} mm/s.",
        "",
    ]
    reachable = [order for order in shares if math.isfinite(shares[order])]
    return "\n".join(lines), [
        Figure(
            "polynomial of the lowest order within reach: delta-v over the least",
            "",
            shares[reachable[0]],
            "",
            1.0,
            10.0,
        ),
        Figure("polynomial of order 30: delta-v over the least", "towards 1", shares[30], "", 1.0, 1.3),
        Figure("cost a F² + b F: delta-v with b alone over that with a alone", "less", best / quadratic, "", 0.3, 1.0),
    ]


covers(
    "Kremmydas 3.4, shift",
    figures=("freedoms: delta-v with the origin shifted, over that without",),
    differs="planned, not flown: the least delta-v over five shifts; guidance shifts none",
)
covers(
    "Kremmydas 3.4, phase per subset",
    figures=("freedoms: delta-v with a phase per subset, over that with one",),
    differs="planned, not flown, and saves nothing here; guidance has one phase for all",
)
covers(
    "Kremmydas 4.3.2, partial thrust",
    figures=(
        "freedoms: delta-v with half thrust in a third of the orbit, over that with all",
        "freedoms: delta-v with none there, over that with half",
    ),
    differs="planned, not flown: a window of the flight software has all thrust or none",
)
covers(
    "Kremmydas Listing: netSATmpc: without the eclipse",
    figures=("freedoms: delta-v with none there, over that with half",),
    differs="the least delta-v without an eclipse and with one, on Hill's equations; the listing prints no result",
)


def freedoms(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """3.4: what free phase, free phases of two subsets, and a shifted origin save; and windows of partial thrust."""
    steps = 250
    flown = scenario(replace(ACQUISITIONS[0], size=500.0), FIXED)
    names = flown.plant.deputies
    starts = [np.array(flown.plant.deputy[name].relative_state) for name in names]
    designs = [Guidance(f"/{name}/guidance", flown.deputies[name]["guidance"]).configuration.design for name in names]
    phases = np.linspace(0.0, PERIOD, 8, endpoint=False)
    costs = np.array(
        [
            [least(start, np.eye(6), design.states(np.array([phase]))[0] / UNIT, steps, AMPLE)[0] for phase in phases]
            for start, design in zip(starts, designs, strict=True)
        ]
    )
    one = float(costs.sum(axis=0).min())
    split = float(costs[:3].sum(axis=0).min() + costs[3].min())
    best = phases[int(costs.sum(axis=0).argmin())]
    shifted = min(
        sum(
            least(
                start,
                np.eye(6),
                design.states(np.array([best]))[0] / UNIT + np.array([0.0, shift, 0, 0, 0, 0]),
                steps,
                AMPLE,
            )[0]
            for start, design in zip(starts, designs, strict=True)
        )
        for shift in (-400.0, -200.0, 0.0, 200.0, 400.0)
    )
    dark = (np.arange(steps) % 25) >= 17
    goal = designs[0].states(np.array([best]))[0] / UNIT
    spent = [
        least(starts[0], np.eye(6), goal, steps, np.where(dark, share * AMPLE, AMPLE))[0] for share in (1.0, 0.5, 0.0)
    ]
    lines = [
        "## Freedoms of a formation (3.4), and windows of partial thrust",
        "",
        "Tetrahedron to three in the plane and one out, 500 m, four satellites in ten orbits: least delta-v of",
        "all, m/s.",
        "",
        "| phase fixed | one phase for all | a phase for the plane, one for the other | and the origin shifted "
        "along the track |",
        "|---|---|---|---|",
        "| "
        + " | ".join(
            ours(f"freedoms: {name}", value, ".4g", "m/s")
            for name, value in (
                ("fixed", float(costs[:, 0].sum())),
                ("one", one),
                ("split", split),
                ("shifted", shifted),
            )
        )
        + " |",
        "",
        "First satellite with all thrust, with half of it and with none in 8 of the 25 steps of an orbit: "
        + ", ".join(
            ours(f"freedoms: {share} in the dark", 1e3 * each, ".4g", "mm/s")
            for share, each in zip(("all", "half", "none"), spent, strict=True)
        )
        + " mm/s.",
        "",
    ]
    return "\n".join(lines), [
        Figure(
            "freedoms: delta-v with a phase per subset, over that with one",
            "reduced (at most 1)",
            split / one,
            "",
            0.0,
            1.0,
        ),
        Figure(
            "freedoms: delta-v with the origin shifted, over that without",
            "reduced (at most 1)",
            shifted / one,
            "",
            0.0,
            1.0,
        ),
        Figure(
            "freedoms: delta-v with half thrust in a third of the orbit, over that with all",
            "at least 1",
            spent[1] / spent[0],
            "",
            1.0,
            3.0,
        ),
        Figure(
            "freedoms: delta-v with none there, over that with half", "at least 1", spent[2] / spent[1], "", 1.0, 3.0
        ),
    ]


covers(
    "Kremmydas 3.2, force-induced",
    "control/lqr.py",
    "control/feed_forward.py",
    figures=(
        "held radial offset: delta-v an orbit over 6 π n x",
        "held cross-track offset: delta-v an orbit over 2 π n z",
        "held offsets: error while held",
    ),
    differs="the cost of holding is given beside what Hill's equations ask; the text gives none",
)


def held(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """A place held off the track against Hill's equations, by LQR with feed-forward."""
    common = CommonParameters(CHIEF, tick=10.0)
    lines = [
        "## Held offsets (3.2, force-induced)",
        "",
        "100 m outwards, and 100 m across, held by LQR with linear feed-forward on Hill's equations, over the",
        "second orbit.",
        "",
        "| offset | delta-v an orbit, m/s | Hill's equations ask for | error, m |",
        "|---|---|---|---|",
    ]
    shares, errors = [], []
    for name, place, asked in (
        ("radial", np.array([100.0, 0, 0, 0, 0, 0]), 6.0 * math.pi * RATE * 100.0),
        ("cross-track", np.array([0, 0, 100.0, 0, 0, 0]), math.tau * RATE * 100.0),
    ):
        law = LinearQuadraticRegulator(
            LqrParameters(
                feed_forward="linear", position_error=(10.0,) * 3, velocity_error=(0.1,) * 3, thrust=(0.002,) * 3
            ),
            common,
            Vehicle(MASS, np.full(3, math.inf)),
        )
        chief, state, used, off = state_from_elements(Elements(**vars(common.chief))), place.copy(), 0.0, 0.0
        ticks = round(PERIOD / 10.0)
        for index in range(2 * ticks):
            stamp = round(index * 10.0 * NANOSECONDS)
            target = Target(stamp, "", place, round(10.0 * NANOSECONDS), np.array([place, place]))
            force = law.command(NavigationState(stamp, state, chief, MASS), target).force
            state = HILL.propagate(0.0, state, 10.0, force / MASS)
            if index >= ticks:
                used += float(np.abs(force).sum()) * 10.0 / MASS
                off = max(off, float(np.linalg.norm((state - place)[:3])))
        shares.append(used / asked)
        errors.append(off)
        words = [
            ours(f"held, {name}: delta-v", used, ".4g", "m/s"),
            f"{asked:.4g}",
            ours(f"held, {name}: error", off, ".2g", "m", 0.01),
        ]
        lines.append(f"| {name} | " + " | ".join(words) + " |")
    lines.append("")
    return "\n".join(lines), [
        Figure("held radial offset: delta-v an orbit over 6 π n x", "1 by Hill's equations", shares[0], "", 0.98, 1.05),
        Figure(
            "held cross-track offset: delta-v an orbit over 2 π n z", "1 by Hill's equations", shares[1], "", 0.98, 1.05
        ),
        Figure("held offsets: error while held", "0", max(errors), "m", 0.0, 1.0),
    ]


covers(
    "Kremmydas 2.3",
    "control/riccati.py",
    figures=("2.3: LQR with a cross term, by the shifted weights, less SciPy's",),
    differs="2 x u has to be positive with the rest: with his weights of one, all x² + u² + 2xu is spent by u = −x",
)


def crossed(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """2.3's cross term 2 x u: the weights of a shifted model, and SciPy's."""
    a, b = HILL.dynamics(0.0) / RATE, HILL.INPUT.astype(float)
    a = a * np.outer(1.0 / np.repeat([1.0, RATE], 3), np.repeat([1.0, RATE], 3))
    q, r = np.eye(6), np.eye(3)
    n = np.vstack([np.zeros((3, 3)), 0.5 * np.eye(3)])
    p = solve_continuous_are(a, b, q, r, s=n)
    theirs = np.linalg.solve(r, b.T @ p + n.T)
    shifted = continuous_gain(a - b @ n.T, b, Weights.scaled(q - n @ n.T, r, 1.0)) + n.T
    off = float(np.abs(shifted - theirs).max())
    lines = [
        "## LQR with a cross term (2.3)",
        "",
        f"x'x + u'u + v'u (N = I/2 on the rates): gains differ from SciPy's by {off:.0e}.",
        "",
    ]
    return "\n".join(lines), [
        Figure("2.3: LQR with a cross term, by the shifted weights, less SciPy's", "0", off, "", 0.0, 1e-9)
    ]


covers(
    "Kremmydas Fig. 4.4; Fig. 4.5; Fig. 4.6; Fig. 4.7; Fig. 4.8; Fig. 4.9; Fig. 4.10; Fig. 4.11; Fig. 4.12",
    "control/mpc.py",
    "guidance/guidance.py",
    figures=("acquisition in space: distance to the slots at the end over that at the start",),
    differs="the plot is lost in the text, and so are its instants; ours is kremmydas_space.png, with the "
    "printed weight",
)
covers(
    "Kremmydas Listing: free flight of 70 orbits",
    "relative/hill.py",
    figures=("free flight: error after 70 orbits, Hill", "free flight: error after 70 orbits, two orbits under J2"),
    differs="on Hill's equations the formation acquired stays to a millimetre, J2 pulls it apart; no figure is printed",
)


def acquisition(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Figs. 4.4 to 4.12 and the 70 orbits after."""
    flight = fly(ACQUISITIONS[0], PRINTED)
    draw(flight, directory / "kremmydas_space.png")
    begun, ended = float(flight.worst(1).max()), float(flight.worst(100).max())
    home = fly(ACQUISITIONS[0], FIXED)
    last, aims = home.states[:, -1], home.targets[:, -1]
    span = 70.0 * PERIOD
    on_hill = max(
        float(np.linalg.norm((HILL.propagate(0.0, state, span) - HILL.propagate(0.0, aim, span))[:3]))
        for state, aim in zip(last, aims, strict=True)
    )
    chief = state_from_elements(Elements(**vars(CHIEF)))
    states = np.array([chief, *(inertial_from_relative(chief, each) for each in last)])
    propagator, off = Propagator(60.0, 3), []
    ticks = round(span / 60.0)
    for index in range(ticks):
        states = propagator.propagate(60.0 * index, states, np.zeros((5, 3)))
        if index >= ticks - round(PERIOD / 60.0):
            time = 60.0 * (index + 1)
            off.append(
                [
                    np.linalg.norm((relative_from_inertial(states[0], state) - HILL.propagate(0.0, aim, time))[:3])
                    for state, aim in zip(states[1:], aims, strict=True)
                ]
            )
    pulled = float(np.max(off))
    lines = [
        "## Figs. 4.4 to 4.12, and 70 orbits of free flight",
        "",
        "Tetrahedron to three in the plane and one out with the printed weight 1.7: from",
        f"{ours('in space: start', begun, '.4g', 'm')} m in the first orbit to",
        f"{ours('in space: end', ended, '.4g', 'm', 0.02 * ended)} m in the hundredth. After the acquisition with 17,",
        "70 orbits without thrust leave",
        f"{ours('free flight: Hill', on_hill, '.1g', 'm', 1e-3)} m on Hill's equations and",
        f"{ours('free flight: J2', pulled, '.4g', 'm', 0.02 * pulled)} m under J2, against targets that Hill's",
        "equations carry.",
        "",
        "![In space](kremmydas_space.png)",
        "",
    ]
    return "\n".join(lines), [
        Figure(
            "acquisition in space: distance to the slots at the end over that at the start",
            "converges (below 1)",
            ended / begun,
            "",
            0.0,
            0.3,
        ),
        Figure("free flight: error after 70 orbits, Hill", "force-free (0)", on_hill, "m", 0.0, 1e-3),
        Figure("free flight: error after 70 orbits, two orbits under J2", "", pulled, "m", 0.0, 3e3),
    ]


def draw(flight: Flight, path: Path) -> None:
    """Nine instants of the acquisition in ESA's axes: the last orbit flown, and the slots."""
    plot = plt.figure(figsize=(15, 14))
    ticks = PERIOD / flight.common.tick
    for index, orbit in enumerate((1, 5, 10, 20, 30, 45, 60, 80, 99)):
        panel = plot.add_subplot(3, 3, index + 1, projection="3d")
        part = slice(round((orbit - 1) * ticks), round(orbit * ticks) + 1)
        for k, color in enumerate(("tab:blue", "tab:orange", "tab:green", "tab:red")):
            for states, style in ((flight.states[k, part], "-"), (flight.targets[k, part], ":")):
                panel.plot(states[:, 1], -states[:, 2], -states[:, 0], style, color=color, lw=1.0)
            panel.plot(*(flight.states[k, part][-1:, [1, 2, 0]] * [1.0, -1.0, -1.0]).T, "o", color=color, ms=4)
        panel.set(xlabel="x, m", ylabel="y, m", zlabel="z, m", title=f"Fig. 4.{index + 4}: orbit {orbit}")
    save(plot, path)
