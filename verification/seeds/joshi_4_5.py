"""Joshi's chapters 4 and 5: LQR, and SDRE in infinite and finite time."""

import math
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from scipy.linalg import expm

from formation_gnc.control.controller import Vehicle
from formation_gnc.control.finite_horizon import Task
from formation_gnc.control.riccati import Weights, continuous_gain
from formation_gnc.control.sdre import Sdre, SdreParameters
from formation_gnc.control.sdre_finite import FiniteSdre, SdreFiniteParameters
from formation_gnc.control.steering import state_dependent
from formation_gnc.mission import Mission
from formation_gnc.mission import Orbit as Chief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import RelativeModel
from verification.control import save
from verification.figure import Figure
from verification.seeds.cases import (
    MU,
    SEMI_MAJOR_AXIS,
    TICK,
    Array,
    Orbit,
    effort,
    fly,
    in_joshis_order,
    model,
    table,
)

mpl.use("Agg")
import matplotlib.pyplot as plt

MISSION = Mission(Chief(SEMI_MAJOR_AXIS), tick=TICK)
HILL = HillModel(math.sqrt(MU / SEMI_MAJOR_AXIS**3))
GAIN = continuous_gain(HILL.dynamics(0.0), HILL.INPUT, Weights.scaled(np.eye(6), 1e9 * np.eye(3), TICK))
"""Of his LQR, Q = I and R = 1e9 I."""
UNLIMITED = Vehicle(1.0, np.full(3, np.inf))
SETTLED = (10.0, 1.0)
"""Errors, m, within which a flight counts as settled."""


def target_rate(orbit: Orbit, time: float) -> Array:
    """(6,) rate of change of a desired state, which moves by Hill's equations."""
    return np.asarray(HILL.dynamics(0.0) @ orbit.state(time))


def lqr(directory: Path) -> tuple[str, list[Figure]]:
    """Table 4.3: 1 to 10 km by LQR on Hill's equations."""
    start, goal, final = Orbit(1.0, 45.0, 1.0), Orbit(10.0, 60.0, 1.5), 2000

    def errors(eccentricity: float, share: float) -> Array:
        plant = model(eccentricity)

        def thrust(time: float, state: Array) -> Array:
            aim = goal.state(time)
            known = target_rate(goal, time) - plant.derivative(time, aim)
            return np.asarray(-GAIN @ (state - aim) + share * known[3:])

        states, _ = fly(plant, start.state(0.0), thrust, final)
        return in_joshis_order(states[-1] - goal.state(final))

    circular, plain, with_it, against = (
        errors(*case) for case in ((0.0, 0.0), (0.15, 0.0), (0.15, 1.0), (0.15, -1.0))
    )
    printed = [0.001619, 6.224e-5, -0.003066, 2.692e-5, -0.006593, -1.039e-5]
    printed_eccentric = [0.035, -8.923e-4, 0.23, -1.395e-2, 0.3337, -1.696e-2]
    text = "\n".join(
        [
            "## Table 4.3: LQR, 1 to 10 km",
            "",
            "Errors after 2000 s, closed loop, Q = I and R = 10⁹ I in km and s. The feed-forward is",
            "what the desired trajectory needs on the exact equations, X_d' − f(X_d), added (+) as it",
            "helps, or taken off as (4.13) has it printed (−). In Hill's A it is zero.",
            "",
            table(
                ["e = 0, printed", "ours", "e = 0.15, printed", "ours, none", "ours, +", "ours, −"],
                [np.array(printed), circular, np.array(printed_eccentric), plain, with_it, against],
            ),
            "Circular, both are metres; the time of the table is not printed, and the error passes",
            "through zero several times on its way down. Eccentric, the printed figures are those of",
            "none of the three: x is of the size of ours without feed-forward, y and z are seven and",
            "twenty times it. The printed velocity errors of 14 and 17 m/s exceed the desired",
            "velocities themselves, 9.3 and 6.4 m/s, and a position error of 400 m that changes at such",
            "a rate is no steady one. With the sign that helps, the",
            "eccentric chief costs LQR nothing.",
            "",
        ]
    )
    size = 1e3 * float(np.linalg.norm(circular[::2]))
    return text, [
        Figure("4.3, circular: position error", "7.4 m", size, "m", 3.0, 6.0),
        Figure("4.3, e = 0.15, no feed-forward: x", "35 m", 1e3 * plain[0], "m", 55.0, 60.0),
        Figure(
            "4.3, e = 0.15, feed-forward that helps: position error",
            "406 m",
            1e3 * float(np.linalg.norm(with_it[::2])),
            "m",
            4.0,
            7.0,
        ),
    ]


def sdre_thrust(plant: RelativeModel, goal: Orbit, factorisation: str, weight: float) -> Callable[..., Array]:
    """SDRE with the known control of (4.13), in the sign that helps; a gain every 10 s."""
    law = Sdre(
        SdreParameters(
            position_error=(1.0,) * 3, velocity_error=(1.0,) * 3, thrust=(1.0 / math.sqrt(weight),) * 3
        ),
        MISSION,
        UNLIMITED,
    )
    kept: list[Array] = []

    def thrust(time: float, state: Array) -> Array:
        aim = goal.state(time)
        (matrix,), _ = state_dependent(plant, factorisation, np.array([time]))(state[None])
        if round(time) % 10 == 0:
            kept[:] = [law.gain(matrix)]
        return np.asarray(-kept[0] @ (state - aim) + (target_rate(goal, time) - matrix @ aim)[3:])

    return thrust


def sdre_infinite(directory: Path) -> tuple[str, list[Figure]]:
    """Tables 5.3 and 5.4: 5 to 25 km by SDRE."""
    start, goal, last = Orbit(5.0, 45.0, 1.0), Orbit(25.0, 60.0, 1.5), 9000
    goals = np.array([goal.state(float(time)) for time in range(last + 1)])
    lines = [
        "## Table 5.3: SDRE, 5 to 25 km about a circular chief",
        "",
        "| R | settling time, printed | ours, to 10 m | to 1 m | effort, printed, 10⁻² | "
        "∫\\|u\\|² dt, m²/s³ | ∫\\|u\\| dt, m/s |",
        "|---|---|---|---|---|---|---|",
    ]
    printed = {1e8: (1500, 4.19), 1e9: (2000, 4.12), 1e10: (5000, 3.58), 1e11: (7500, 3.02)}
    figures, plot = [], plt.figure(figsize=(13, 4.5))
    path, history, error = plot.subplots(1, 3)
    for weight, (settling, printed_effort) in printed.items():
        plant = model(0.0)
        states, accelerations = fly(plant, start.state(0.0), sdre_thrust(plant, goal, "sdc1", weight), last)
        off = np.linalg.norm((states - goals)[:, :3], axis=1)
        settled = [int(np.nonzero(off > limit)[0][-1]) + 1 for limit in SETTLED]
        power = math.log10(weight)
        lines.append(
            f"| 10^{power:.0f} | {settling} s | {settled[0]} s | {settled[1]} s | {printed_effort} | "
            f"{effort(accelerations):.4g} | {np.linalg.norm(accelerations, axis=1).sum():.4g} |"
        )
        name, ours = f"5.3, R = 10^{power:.0f}", effort(accelerations)
        figures.append(
            Figure(
                f"{name}: settling to 1 m", f"{settling} s", settled[1], "s", 0.9 * settling, 1.4 * settling
            )
        )
        figures.append(
            Figure(
                f"{name}: effort",
                "(no unit)",
                ours,
                "m²/s³",
                *(each * EFFORTS[weight] for each in (0.98, 1.02)),
            )
        )
        path.plot(states[:, 1] / 1e3, states[:, 0] / 1e3, label=f"R = 10^{power:.0f}")
        history.plot(np.linalg.norm(accelerations[:3000], axis=1))
        error.semilogy(off)
    lines += [
        "",
        "The printed settling times lie near ours to 1 m. The printed efforts change by a factor of 1.4",
        "while R changes by a thousand. Ours change by 170 as ∫|u|² dt, by 13 as its root and by 5.3 as",
        "∫|u| dt. None can change by as little as is printed: over the same distance d in a time T, |u|",
        "is of the size d/T² and ∫|u| dt of d/T, and T itself, printed and ours, changes by five.",
        "",
    ]
    path.set(xlabel="y, km", ylabel="x, km", title="Fig. 5.5: trajectories, e = 0")
    path.legend(fontsize=8)
    history.set(xlabel="time, s", ylabel="|u|, m/s²", title="control")
    error.set(xlabel="time, s", ylabel="position error, m", title="Fig. 5.6: errors")
    save(plot, directory / "seeds_sdre.png")
    lines += ["![SDRE from 5 to 25 km](seeds_sdre.png)", ""]

    plant, columns = model(0.15), []
    for factorisation in ("sdc1", "sdc2"):
        states, _ = fly(plant, start.state(0.0), sdre_thrust(plant, goal, factorisation, 1e9), 4000)
        columns.append(in_joshis_order(states[-1] - goals[4000]))
    one, two = (1e3 * float(np.linalg.norm(column[::2])) for column in columns)
    lines += [
        "## Table 5.4: SDRE about an eccentric chief, methods I and II",
        "",
        "e = 0.15, R = 10⁹ I, after the 4000 s of Fig. 5.7.",
        "",
        table(
            ["I, printed", "I, ours", "II, printed", "II, ours"],
            [
                np.array([0.0003, 2.45e-6, -0.00096, -1.47e-6, -0.005931, 9.312e-6]),
                columns[0],
                np.array([0.0085, -5.3e-5, 0.002985, 2.95e-5, -0.0011, -3.013e-5]),
                columns[1],
            ],
        ),
        f"Method I leaves {100.0 * one:.0f} cm here and 6.0 m as printed: with the known control of",
        "(4.13) in the sign that helps, only the transient is left. Method II takes the square of the",
        f"chief's rate for μ/r³ and leaves out its angular acceleration, and keeps {two:.0f} m for that",
        "(printed: 9.1 m). That is an order and more above method I, as printed; how much depends on",
        "where the chief is on its ellipse.",
        "",
    ]
    figures += [
        Figure("5.4, method I: position error", "6.0 m", one, "m", *LEFT["sdc1"]),
        Figure("5.4, method II: position error", "9.1 m", two, "m", *LEFT["sdc2"]),
    ]
    return "\n".join(lines), figures


EFFORTS = {1e8: 524.3, 1e9: 93.3, 1e10: 16.7, 1e11: 3.09}
"""m^2/s^3, as measured first: a regression figure."""
LEFT = {"sdc1": (0.0, 1.0), "sdc2": (60.0, 75.0)}
"""m, for the same reason."""


def finite(directory: Path) -> tuple[str, list[Figure]]:
    """Table 5.6: 10 to 100 km by finite-time SDRE."""
    start, goal, final = Orbit(10.0, 5.0, 1.0), Orbit(100.0, 35.0, 1.5), 2000
    printed = {
        (0.0, "sdc1"): [0.1798, 0.0006, -0.1314, 0.00026, -1.226, -0.0015],
        (0.0, "sdc2"): [0.3901, 0.00022, -0.477, -0.00051, -1.411, -0.0017],
        (0.05, "sdc1"): [0.08, 0.00019, -0.273, 0.000205, -1.389, -0.0014],
        (0.05, "sdc2"): [-68.15, -0.0982, -17.35, 0.04, -18.51, -0.01502],
        (0.15, "sdc1"): [-1.178, -0.0008, 1.693, 0.005036, 0.80613, 0.0007],
        (0.15, "sdc2"): [246.8, -0.0041, -160.0, -0.4, -28.43, -0.005],
    }
    lines = [
        "## Table 5.6: finite-time SDRE, 10 to 100 km in 2000 s",
        "",
        "Three readings of 5.2: (a) the matrices of t₀ kept all the way; (b) the transition matrix from",
        "t₀ made anew at every second with the matrices of now; (c) the problem solved anew at every",
        "second for the time to go, from the state of now. Errors of position, in km, and effort ∫|u|²",
        "dt.",
        "",
        "| e | method | printed x, y, z | (a) | (b) | (c) | effort of (c), m²/s³ |",
        "|---|---|---|---|---|---|---|",
    ]
    figures, plot = [], plt.figure(figsize=(13, 4.5))
    panels = plot.subplots(1, 3)
    for panel, eccentricity in zip(panels, (0.0, 0.05, 0.15), strict=True):
        for factorisation in ("sdc1", "sdc2"):
            plant = model(eccentricity)
            flights = [
                fly(plant, start.state(0.0), thrust, final)
                for thrust in (
                    from_start(plant, factorisation, start, goal, final, anew=False),
                    from_start(plant, factorisation, start, goal, final, anew=True),
                    to_go(plant, factorisation, goal, final),
                )
            ]
            left = [(states[-1] - goal.state(final))[:3] / 1e3 for states, _ in flights]
            words = [", ".join(f"{value:.3g}" for value in each) for each in left]
            theirs = ", ".join(f"{printed[eccentricity, factorisation][row]:g}" for row in (0, 2, 4))
            cost = effort(flights[2][1])
            lines.append(
                f"| {eccentricity:g} | {factorisation} | {theirs} | " + " | ".join(words) + f" | {cost:.2f} |"
            )
            distance = np.linalg.norm([printed[eccentricity, factorisation][row] for row in (0, 2, 4)])
            figures.append(
                Figure(
                    f"5.6, e = {eccentricity:g}, {factorisation}, (c): position error",
                    f"{distance:.3g} km",
                    1e3 * float(np.linalg.norm(left[2])),
                    "m",
                    0.0,
                    0.1,
                )
            )
            for name, (states, _) in zip("abc", flights, strict=True):
                goals = np.array([goal.state(float(time)) for time in range(final + 1)])
                off = np.linalg.norm((states - goals)[:, :3], axis=1)
                style = "-" if factorisation == "sdc1" else ":"
                panel.semilogy(off, style, label=f"{factorisation} ({name})")
        panel.set(xlabel="time, s", ylabel="distance from the target, m", title=f"e = {eccentricity:g}")
    panels[0].legend(fontsize=8)
    save(plot, directory / "seeds_sdre_finite.png")
    lines += [
        "",
        "With the time to go the end is met, by either factorisation. The printed kilometres of method",
        "I are those of readings (a) and (b), in which nothing is fed back: (a) never looks at the",
        "state again, (b) only through the matrices. Method II is the worse the more eccentric the",
        "chief is, printed and ours; the printed hundreds of kilometres, though, are more than the",
        "formation's size, and no reading gives them. For e = 0 both methods factorise the same",
        "equations, and ours agree; the printed ones differ by up to 350 m, the z component by 190 m,",
        "though its equation is the same in both.",
        "",
        "![Distance from the target](seeds_sdre_finite.png)",
        "",
    ]
    return "\n".join(lines), figures


UNIT = np.repeat([1.0, 1e-3], 3)
"""Of states: seconds count by the thousand."""


def hamiltonian(dynamics: Array) -> Array:
    """(12, 12) of (5.12) with Q = 0 and R = I, per 1000 s, in `UNIT`."""
    scaled = 1e3 * dynamics * np.outer(1.0 / UNIT, UNIT)
    matrix = np.zeros((12, 12))
    matrix[:6, :6], matrix[6:, 6:] = scaled, -scaled.T
    matrix[3:6, 9:] = -np.eye(3)
    return matrix


def from_start(
    plant: RelativeModel, factorisation: str, start: Orbit, goal: Orbit, final: int, anew: bool
) -> Callable[..., Array]:
    """(5.13)-(5.16) as printed, with the transition matrix always from t_0."""
    begin, end = start.state(0.0) / UNIT, goal.state(float(final)) / UNIT
    kept: list[Array] = []

    def thrust(time: float, state: Array) -> Array:
        if anew or not kept:
            (matrix,), _ = state_dependent(plant, factorisation, np.array([time]))(state[None])
            whole = expm(hamiltonian(matrix) * final / 1e3)
            kept[:] = [hamiltonian(matrix), np.linalg.solve(whole[:6, 6:], end - whole[:6, :6] @ begin)]
        until = expm(kept[0] * time / 1e3)
        return np.asarray(-1e-6 * (until[6:, :6] @ begin + until[6:, 6:] @ kept[1])[3:])

    return thrust


def to_go(plant: RelativeModel, factorisation: str, goal: Orbit, final: int) -> Callable[..., Array]:
    """The law's plan at every second, of which only the first step is flown; the last two are one plan."""
    law = FiniteSdre(SdreFiniteParameters(factorisation=factorisation), MISSION, UNLIMITED)
    end, kept = goal.state(float(final)), list[Array]()

    def thrust(time: float, state: Array) -> Array:
        left = final - round(time)
        if left == 1:
            return kept[1]
        steps = max(2, math.ceil(left / 50.0))
        plan = law.plan(Task(plant, time, state, end, float(left), steps))
        kept[:] = plan.mean(np.array([0.0, 1.0]), np.array([1.0, 2.0]))
        return kept[0]

    return thrust


def section(directory: Path) -> tuple[str, list[Figure]]:
    """Tables 4.3, 5.3, 5.4 and 5.6."""
    texts, figures = [], []
    for part in (lqr, sdre_infinite, finite):
        text, limits = part(directory)
        texts.append(text)
        figures += limits
    return "\n".join(texts), figures
