"""Joshi's chapter 8: LQR with networks that learn in flight what its model leaves out."""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np

from formation_gnc.control.networks import Networks, Regulator, functions
from formation_gnc.control.riccati import Weights, continuous_cost_to_go
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.oblate import OblateModel
from verification.control import save
from verification.figure import Figure
from verification.seeds.cases import (
    KM,
    MU,
    SEMI_MAJOR_AXIS,
    TICK,
    TRUE_ANOMALY,
    Array,
    Orbit,
    effort,
    fly,
    in_joshis_order,
    table,
)
from verification.seeds.joshi_4_5 import HILL, sdre_thrust

mpl.use("Agg")
import matplotlib.pyplot as plt

FINAL = 2000
ACTUAL = 11114.51658 * KM
START, GOAL = Orbit(0.5, 45.0, 1.0), Orbit(5.0, 60.0, 1.5)
INCLINATION = math.radians(60.0)
"""Not printed for this case; that of the other cases with J2."""
REACH = 10.0 * KM
IDENTIFICATION_TIME, INERTIA = 20.0, 0.1
WEIGHTS = Weights.scaled(np.eye(6), 1e9 * np.eye(3), TICK)
PACE = math.sqrt(WEIGHTS.input_unit[0])
UNIT, INPUT_UNIT = REACH * WEIGHTS.state_unit, REACH * WEIGHTS.input_unit


def plant(eccentricity: float) -> OblateModel:
    """The true equations, of which the regulator knows a circle of 10000 km and no J2."""
    return OblateModel(KeplerChief(ACTUAL, eccentricity, INCLINATION, true_anomaly=TRUE_ANOMALY, mu=MU))


@dataclass
class Learner:
    """The regulator with its networks, and what it noted at every second."""

    truth: OblateModel
    learns: bool

    def __post_init__(self) -> None:
        """Start from zero weights."""
        cost_to_go, _ = continuous_cost_to_go(HILL.dynamics(0.0), HILL.INPUT, WEIGHTS)
        dynamics = WEIGHTS.step(HILL.dynamics(0.0), HILL.INPUT)[0] / PACE
        self.networks = Networks(
            Regulator(dynamics, WEIGHTS.state, WEIGHTS.input, cost_to_go), IDENTIFICATION_TIME * PACE, INERTIA
        )
        self.predicted = np.zeros(6)
        self.missing: list[Array] = []
        self.identified: list[Array] = []
        self.weights: list[Array] = []

    def __call__(self, time: float, state: Array) -> Array:
        """Acceleration, m/s^2."""
        networks, error = self.networks, (state - GOAL.state(time)) / UNIT
        if self.learns:
            latitude = TRUE_ANOMALY + HILL.mean_motion * time
            values, slopes = functions(state / UNIT, SEMI_MAJOR_AXIS / REACH, latitude)
            if time == 0.0:
                networks.meet(error)
            networks.identify(error, values, slopes, TICK * PACE)
        thrust = networks.thrust(error)
        if self.learns:
            following = networks.fly(error, values, thrust, TICK * PACE)
            networks.teach(error, following, slopes, TICK * PACE)
            self.predicted = following * UNIT
            self.missing.append((self.truth.derivative(time, state) - HILL.derivative(time, state))[3:])
            self.identified.append(INPUT_UNIT * (values @ networks.model_weights))
            self.weights.append(networks.model_weights.copy())
        return np.asarray(INPUT_UNIT * thrust)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """Table 8.2, as printed and with a chief that flies above the ground."""
    printed = {
        "LQR": [-49.51, -0.04335, 5.665, 0.0445, -44.1, -0.03031],
        "LQR + NN": [0.1544, 5.158e-5, 0.007096, -0.00047, -0.047, -9.702e-5],
        "approximate plant": [0.1543, 5.16e-5, 0.006627, -0.000468, -0.047, -9.693e-5],
        "SDRE": [0.04326, 1.56e-5, 0.02603, -1.95e-5, 0.02704, 3.97e-5],
    }
    lines = [
        "## Table 8.2: LQR and two networks",
        "",
        "0.5 to 5 km in 2000 s with J2; the regulator is designed for a circle of 10000 km, the chief has",
        "11114.5 km and e = 0.5 as printed, which leads through the Earth, and e = 0.3, which does not. i",
        "= 60°, not printed. *Open loop* is LQR's history of the circular linear model applied as it is.",
        "",
    ]
    figures = []
    plot = plt.figure(figsize=(14, 7.2))
    rows = plot.subplots(2, 4)
    for panels, eccentricity in zip(rows, (0.5, 0.3), strict=True):
        truth = plant(eccentricity)
        plain, learner = Learner(truth, False), Learner(truth, True)
        _, history = fly(HILL, START.state(0.0), plain, FINAL)
        flights = {
            "open loop": fly(truth, START.state(0.0), lambda time, _, h=history: h[round(time)], FINAL),
            "LQR": fly(truth, START.state(0.0), plain, FINAL),
            "LQR + NN": fly(truth, START.state(0.0), learner, FINAL),
            "SDRE": fly(truth, START.state(0.0), sdre_thrust(truth, GOAL, "sdc1", 1e9), FINAL),
        }
        left = {name: states[-1] - GOAL.state(FINAL) for name, (states, _) in flights.items()}
        left["approximate plant"] = learner.predicted
        heading, columns = [], []
        for name in ("open loop", "LQR", "LQR + NN", "approximate plant", "SDRE"):
            if eccentricity == 0.5 and name in printed:
                heading.append(f"{name}, printed")
                columns.append(np.array(printed[name]))
            heading.append(f"{name}, ours")
            columns.append(in_joshis_order(left[name]))
        identified, missing = np.array(learner.identified), np.array(learner.missing)
        off = np.linalg.norm((identified - missing)[100:], axis=1) / np.linalg.norm(missing[100:], axis=1)
        lines += [
            f"### e = {eccentricity:g}",
            "",
            table(heading, columns),
            "Effort ∫|u|² dt: "
            + ", ".join(f"{name} {effort(flown):.4g}" for name, (_, flown) in flights.items())
            + f" m²/s³. What the model lacks is identified to {100.0 * float(np.median(off)):.0f} %",
            "(median after 100 s).",
            "",
        ]
        sizes = {name: float(np.linalg.norm(error[:3])) for name, error in left.items()}
        label = f"8.2, e = {eccentricity:g}"
        gone = sizes["LQR + NN"] / sizes["LQR"]
        figures += [
            Figure(f"{label}: open loop", "66.5 km (LQR)", sizes["open loop"], "m", *OPEN[eccentricity]),
            Figure(f"{label}: LQR + NN over LQR, position", "0.0024", gone, "", 0.0, 0.6),
            Figure(f"{label}: LQR + NN", "162 m", sizes["LQR + NN"], "m", 0.0, 40.0),
            Figure(f"{label}: SDRE", "57.7 m", sizes["SDRE"], "m", 0.0, 60.0),
            Figure(f"{label}: d identified to", "by eye", float(np.median(off)), "", 0.0, 0.2),
        ]
        goals = np.array([GOAL.state(float(time)) for time in range(FINAL + 1)])
        for name, (states, _) in flights.items():
            panels[0].plot(states[:, 1] / 1e3, states[:, 0] / 1e3, label=name)
            panels[1].semilogy(np.linalg.norm((states - goals)[:, :3], axis=1))
        panels[0].plot(goals[:, 1] / 1e3, goals[:, 0] / 1e3, "k:", lw=0.8)
        panels[0].legend(fontsize=8)
        panels[0].set(xlabel="y, km", ylabel="x, km", title=f"trajectories, e = {eccentricity:g}")
        panels[1].set(xlabel="time, s", ylabel="m", title="distance from X_d(t)")
        panels[2].plot(missing, "k", lw=0.8)
        panels[2].plot(identified, "--")
        panels[2].set(xlabel="time, s", ylabel="m/s²", title="d, actual (black) and identified")
        panels[3].plot(np.array(learner.weights).reshape(FINAL, -1), lw=0.7)
        panels[3].set(xlabel="time, s", title="weights of NN2")
    save(plot, directory / "seeds_networks.png")
    lines += [
        "The printed column LQR is open loop, as in chapters 6 and 7: in closed loop LQR alone is",
        "hundreds of times better, because feedback answers what the model lacks. The networks take away",
        "most of what it leaves. They need no knowledge of the orbit; SDRE has all of it and its own",
        "known control (4.13). The approximate plant is the state that the learnt model predicts for the",
        "final time a second before.",
        "",
        "![Trajectories, distances, identification and weights](seeds_networks.png)",
        "",
    ]
    return "\n".join(lines), figures


OPEN = {0.5: (12270.0, 12770.0), 0.3: (4744.0, 4938.0)}
"""m, as measured first: a regression figure."""
