"""Joshi beyond his tables: the planes, a circular chief, a relative orbit with all constants, the bound (8.27)."""

import math
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.static_programming import mpsp
from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import RelativeModel
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours, joined
from verification.seeds.cases import KM, MU, SEMI_MAJOR_AXIS, Orbit, effort, fly, model
from verification.seeds.joshi_4_5 import GAIN, goals_of, sdre_thrust, to_go
from verification.seeds.joshi_6_7 import FINAL, NEAR, TIGHT, WIDE, task_of

PAGE = "joshi"

Array = NDArray[np.float64]

RATE = math.sqrt(MU / SEMI_MAJOR_AXIS**3)
PLANES = (("x", "y", 0, 1), ("x", "z", 0, 2), ("y", "z", 1, 2))


def section(directory: Path) -> tuple[str, list[Figure]]:
    """All parts."""
    return joined(directory, planes, circular, all_constants, bound)


covers(
    "Joshi Fig. 4.2; Fig. 4.3; Fig. 4.4",
    "control/lqr.py",
    figures=("planes: LQR, error after 2000 s",),
    differs="the plot is lost in the text; ours is joshi_planes.png",
)
covers(
    "Joshi Fig. 5.3",
    "control/sdre.py",
    figures=("planes: SDRE, error after 4000 s",),
    differs="the plot is lost in the text; ours is joshi_planes.png",
)


def lqr_thrust(plant: RelativeModel, goal: Orbit, time: float, state: Array) -> Array:
    """(4.13) about a circular chief, where the known control is zero in Hill's A."""
    return np.asarray(-GAIN @ (state - goal.state(time)))


def planes(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Figs. 4.2 to 4.4 and 5.3: the transfers of Tables 4.3 and 5.3 in the three planes."""
    plot, panels = plt.subplots(2, 3, figsize=(15, 9))
    circle = model(0.0)
    cases = (
        ("LQR", Orbit(1.0, 45.0, 1.0), Orbit(10.0, 60.0, 1.5), 2000),
        ("SDRE", Orbit(5.0, 45.0, 1.0), Orbit(25.0, 60.0, 1.5), 4000),
    )
    left = {}
    for row, (name, start, goal, final) in zip(panels, cases, strict=True):
        law = partial(lqr_thrust, circle, goal) if name == "LQR" else sdre_thrust(circle, goal, "sdc1", 1e9)
        states, _ = fly(circle, start.state(0.0), law, final)
        left[name] = float(np.linalg.norm(states[-1, :3] - goal.state(final)[:3]))
        turn = np.linspace(0.0, math.tau / RATE, 300)
        for panel, (one, other, i, j) in zip(row, PLANES, strict=True):
            panel.plot(states[:, i] / KM, states[:, j] / KM)
            for orbit, style in ((start, "k:"), (goal, "k--")):
                whole = np.array([orbit.state(time) for time in turn]) / KM
                panel.plot(whole[:, i], whole[:, j], style, lw=0.8)
            figures = {"LQR": f"Fig. 4.{PLANES.index((one, other, i, j)) + 2}", "SDRE": "Fig. 5.3"}
            panel.set(xlabel=f"{one}, km", ylabel=f"{other}, km", title=f"{figures[name]}: {name}", aspect="equal")
    save(plot, directory / "joshi_planes.png")
    lines = [
        "## Figs. 4.2 to 4.4 and 5.3: in the planes",
        "",
        f"About a circular chief: LQR from 1 to 10 km leaves {ours('planes: LQR', left['LQR'], '.3g', 'm')} m",
        "after 2000 s,",
        f"SDRE from 5 to 25 km {ours('planes: SDRE', left['SDRE'], '.3g', 'm')} m after 4000 s. Dotted and",
        "dashed: the orbits",
        "left and taken.",
        "",
        "![In the planes](joshi_planes.png)",
        "",
    ]
    return "\n".join(lines), [
        Figure("planes: LQR, error after 2000 s", "7.4 m (Table 4.3)", left["LQR"], "m", 1.0, 10.0),
        Figure("planes: SDRE, error after 4000 s", "settled in 2000 s (Table 5.3)", left["SDRE"], "m", 0.0, 1.0),
    ]


covers(
    "Joshi Fig. 6.1",
    "control/mpsp.py",
    figures=("Fig. 6.1: MPSP, position error", "Fig. 6.1: effort of SDRE over that of MPSP"),
    differs="the plot is lost in the text; ours is joshi_6_1.png",
)


def circular(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Fig. 6.1: 0.5 to 5 km about a circular chief, by guess, MPSP and SDRE."""
    circle = model(0.0)
    task = task_of(circle, NEAR, WIDE)
    assert task.guess is not None
    history, plan = task.guess, mpsp(task, TIGHT, 10)
    flights = {
        "guess (LQR)": fly(circle, task.state, lambda time, _: history[round(time)], FINAL),
        "MPSP": fly(circle, task.state, lambda time, _: plan.acceleration[round(time)], FINAL),
        "SDRE": fly(circle, task.state, to_go(circle, "sdc1", WIDE, FINAL), FINAL),
    }
    plot = plt.figure(figsize=(7, 6))
    space = plot.add_subplot(projection="3d", elev=30.0, azim=-150.0)
    for name, (states, _) in flights.items():
        space.plot(*(states[:, :3] / KM).T, label=name)
    space.plot(*(goals_of(WIDE, FINAL)[:, :3] / KM).T, "k:", label="desired")
    space.set(xlabel="x, km", ylabel="y, km", zlabel="z, km", title="Fig. 6.1: 0.5 to 5 km, e = 0")
    space.legend()
    save(plot, directory / "joshi_6_1.png")
    spent = {name: effort(accelerations) for name, (_, accelerations) in flights.items()}
    missed = float(np.linalg.norm(plan.errors[-1][:3]))
    lines = [
        "## Fig. 6.1: about a circular chief",
        "",
        "Effort ∫|u|² dt: "
        + ", ".join(f"{name} {ours(f'Fig. 6.1, {name}: effort', each, '.4g', 'm²/s³')}" for name, each in spent.items())
        + " m²/s³.",
        "",
        "![Fig. 6.1](joshi_6_1.png)",
        "",
    ]
    return "\n".join(lines), [
        Figure("Fig. 6.1: MPSP, position error", "below 1 % of 5 km", missed, "m", 0.0, float(TIGHT[0])),
        Figure(
            "Fig. 6.1: effort of SDRE over that of MPSP",
            "1.1 (76.02 over 69.07)",
            spent["SDRE"] / spent["MPSP"],
            "",
            1.0,
            1.02,
        ),
    ]


covers(
    "Joshi relative orbit with a, b and n",
    "guidance/relative_orbit.py",
    "control/mpsp.py",
    figures=(
        "all constants: error of Hill's free motion over an orbit",
        "all constants: LQR, error after 2000 s",
        "all constants: drift a revolution over 3 π a",
    ),
    differs="every table of his has a = b = n = 0: nothing is printed to compare with",
)


def all_constants(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """A relative orbit with a, b, m and n other than zero: free on Hill's equations, and held by LQR."""
    constants = RelativeOrbitParameters(rho=2000.0, theta=math.radians(60.0), a=50.0, b=-300.0, m=1.5, n=0.4)
    orbit, hill, period = RelativeOrbit(constants, RATE), HillModel(RATE), math.tau / RATE
    times = np.linspace(0.0, period, 200)
    targets = orbit.states(times)
    free = np.array([hill.propagate(0.0, targets[0], float(time)) for time in times])
    off = float(np.linalg.norm((free - targets)[:, :3], axis=1).max())
    drifted = float(targets[-1, 1] - targets[0, 1])
    plant = model(0.0)
    start = Orbit(0.5, 45.0, 1.0).state(0.0)
    states, accelerations = fly(
        plant, start, lambda time, state: np.asarray(-GAIN @ (state - orbit.states(np.array([time]))[0])), 2000
    )
    error = float(np.linalg.norm((states[-1] - orbit.states(np.array([2000.0]))[0])[:3]))
    plot, panels = plt.subplots(1, 3, figsize=(15, 4.5))
    for panel, (one, other, i, j) in zip(panels, PLANES, strict=True):
        panel.plot(targets[:, i] / KM, targets[:, j] / KM, "k--", label="desired, an orbit")
        panel.plot(states[:, i] / KM, states[:, j] / KM, label="LQR, 2000 s")
        panel.set(xlabel=f"{one}, km", ylabel=f"{other}, km")
    panels[0].legend()
    save(plot, directory / "joshi_all_constants.png")
    lines = [
        "## A relative orbit with all constants",
        "",
        "ρ = 2 km, θ = 60°, a = 50 m, b = −300 m, m = 1.5, n = 0.4, by LQR from the 0.5 km of Table 6.1: error after",
        f"2000 s {ours('all constants: error', error, '.3g', 'm')} m, effort",
        f"{ours('all constants: effort', effort(accelerations), '.4g', 'm²/s³')} m²/s³. a drifts by −3πa a revolution.",
        "",
        "![All constants](joshi_all_constants.png)",
        "",
    ]
    return "\n".join(lines), [
        Figure("all constants: error of Hill's free motion over an orbit", "0", off, "m", 0.0, 1e-6),
        Figure(
            "all constants: drift a revolution over 3 π a", "-1", drifted / (3.0 * math.pi * 50.0), "", -1.0001, -0.9999
        ),
        Figure("all constants: LQR, error after 2000 s", "", error, "m", 0.0, 20.0),
    ]


covers(
    "Joshi (8.19)-(8.27)",
    "control/networks.py",
    figures=(
        "(8.27): share of steps with abs(e) above the bound on which V falls",
        "(8.27): lasting error over the bound",
        "(8.27): bound at ten times the gain over that at one",
    ),
    differs="V falls wherever abs(e) exceeds abs(epsilon)/k, as there; that all abs(e) end below it does "
    "not follow, since epsilon moves",
)


def bound(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """One channel of the virtual plant with the update rule (8.25): e' = W~ phi + epsilon - k e."""
    period, step = 1000.0, 0.1
    times = np.arange(0.0, 20.0 * period, step)
    phase = math.tau * times / period
    basis = np.stack([np.ones_like(times), np.sin(phase), np.cos(phase)])
    slopes = np.stack([np.zeros_like(times), np.cos(phase), -np.sin(phase)])
    ideal, rest = np.array([1.0, -0.5, 0.8]), 0.05 * np.sin(3.0 * phase)
    plot, panels = plt.subplots(1, 2, figsize=(13, 4.5))
    shares, lasting, levels = [], [], []
    lines = [
        "## The bound (8.27)",
        "",
        "One channel: d = W'φ + ε of three basis functions of the orbit's phase and a rest ε of 0.05 at three",
        "times its",
        "rate;",
        "the observer with k, weights by (8.25) with β = γ = 1/50, Θ = 1. Time unit of order one.",
        "",
        "| k | bound, greatest abs(ε)/k | abs(e), last tenth | steps above the bound with V falling, % |",
        "|---|---|---|---|",
    ]
    beta = gamma = 0.02
    for k in (0.1, 0.3, 1.0):
        inverse = [np.linalg.inv(np.eye(3) / gamma + np.outer(s, s)) for s in slopes.T[:: round(1.0 / step)]]
        weights, error = np.zeros(3), 0.0
        kept, rising = np.empty(len(times)), []
        for index in range(len(times)):
            phi, off = basis[:, index], ideal - weights
            kept[index] = error
            level = abs(rest[index]) / k
            change = beta * error * rest[index] - k * beta * error**2
            if abs(error) > level:
                rising.append(change < 0.0)
            slope = off @ phi + rest[index] - k * error
            weights = weights + step * beta * error * inverse[index // round(1.0 / step)] @ phi
            error += step * slope
        limit = 0.05 / k
        last = float(np.abs(kept[-len(kept) // 10 :]).max())
        shares.append(float(np.mean(rising)))
        lasting.append(last / limit)
        levels.append(limit)
        panels[0].semilogy(times / period, np.abs(kept) + 1e-6, lw=0.8, label=f"k = {k:g}")
        panels[0].axhline(limit, ls=":", lw=0.8)
        words = [
            ours(f"(8.27), k = {k:g}: bound", limit, ".3g"),
            ours(f"(8.27), k = {k:g}: last", last, ".3g", margin=0.01 * last),
            ours(f"(8.27), k = {k:g}: falling", 100.0 * shares[-1], ".1f", "%", 0.1),
        ]
        lines.append(f"| {k:g} | " + " | ".join(words) + " |")
    panels[0].set(xlabel="revolutions", ylabel="abs(e)", title="(8.27): error and, dotted, abs(ε)/k")
    panels[0].legend()
    grid = np.logspace(-2, 1, 50)
    panels[1].loglog(grid, 0.05 / grid)
    panels[1].set(xlabel="k", ylabel="abs(ε)/k", title="the bound falls as the gain grows")
    save(plot, directory / "joshi_8_27.png")
    lines += ["", "![The bound](joshi_8_27.png)", ""]
    return "\n".join(lines), [
        Figure("(8.27): share of steps with abs(e) above the bound on which V falls", "1", min(shares), "", 1.0, 1.0),
        Figure("(8.27): lasting error over the bound", "at most 1", max(lasting), "", 1.0, 2.0),
        Figure(
            "(8.27): bound at ten times the gain over that at one", "0.1", levels[-1] / levels[0], "", 0.0999, 0.1001
        ),
    ]
