"""Joshi's chapters 4 and 5: LQR, and SDRE in infinite and finite time."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from formation_gnc.common import CommonParameters
from formation_gnc.common import Orbit as Chief
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.fixed_endpoint_lq import state_dependent
from formation_gnc.control.plan import Task
from formation_gnc.control.riccati import Weights, continuous_gain
from formation_gnc.control.sdre import Sdre, SdreParameters
from formation_gnc.control.sdre_finite import FiniteSdre, SdreFiniteParameters
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.oblate import OblateModel
from verification.coverage.marker import covers
from verification.figure import Figure
from verification.seeds.accepted import Ours, joined
from verification.seeds.cases import (
    MU,
    SEMI_MAJOR_AXIS,
    TICK,
    Array,
    Orbit,
    chief,
    effort,
    fly,
    model,
    picture,
    table,
)

MISSION = CommonParameters(Chief(SEMI_MAJOR_AXIS), tick=TICK)
HILL = HillModel(math.sqrt(MU / SEMI_MAJOR_AXIS**3))
GAIN = continuous_gain(HILL.dynamics(0.0), HILL.INPUT, Weights.scaled(np.eye(6), 1e9 * np.eye(3), TICK))
"""Of his LQR, Q = I and R = 1e9 I."""
UNLIMITED = Vehicle(1.0, np.full(3, np.inf))
SETTLED = (10.0, 1.0)
"""Errors, m, within which a flight counts as settled."""


def target_rate(orbit: Orbit, time: float) -> Array:
    """(6,) rate of change of a desired state, which moves by Hill's equations."""
    return np.asarray(HILL.dynamics(0.0) @ orbit.state(time))


def goals_of(goal: Orbit, last: int) -> Array:
    """(last + 1, 6) desired states, one a second."""
    return np.array([goal.state(float(time)) for time in range(last + 1)])


covers(
    "Joshi Table 4.1; Table 4.2; Table 4.3",
    "control/lqr.py",
    "control/feed_forward.py",
    figures=(
        "4.3, circular: position error, metres both",
        "4.3: e = 0.15 with feed-forward over e = 0",
    ),
    differs=(
        "the time of the table is not printed, and the eccentric column follows from no sign of the "
        "feed-forward: its velocity errors exceed the desired velocities"
    ),
)
covers(
    "Joshi Fig. 4.1; Fig. 4.5; Fig. 4.6; Fig. 4.7; Fig. 4.8; Fig. 4.9",
    "control/lqr.py",
    figures=("4.3, circular: position error, metres both",),
    differs="the plot is lost in the text; ours is seeds_4_3.png, with errors as lengths",
)


def lqr(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Table 4.3: 1 to 10 km by LQR on Hill's equations."""
    start, goal, final = Orbit(1.0, 45.0, 1.0), Orbit(10.0, 60.0, 1.5), 2000
    flights, left = {}, {}
    for name, eccentricity, share in (
        ("e = 0", 0.0, 0.0),
        ("e = 0.15, none", 0.15, 0.0),
        ("e = 0.15, +", 0.15, 1.0),
        ("e = 0.15, −", 0.15, -1.0),
    ):

        def thrust(time: float, state: Array, plant: RelativeModel, share: float) -> Array:
            aim = goal.state(time)
            known = target_rate(goal, time) - plant.derivative(time, aim)
            return np.asarray(-GAIN @ (state - aim) + share * known[3:])

        plant = model(eccentricity)
        flights[name] = fly(plant, start.state(0.0), partial(thrust, plant=plant, share=share), final)
        left[name] = flights[name][0][-1] - goal.state(final)
    picture(directory / "seeds_4_3.png", "LQR, 1 to 10 km", flights, goals_of(goal, final))
    printed = [0.001619, 6.224e-5, -0.003066, 2.692e-5, -0.006593, -1.039e-5]
    printed_eccentric = [0.035, -8.923e-4, 0.23, -1.395e-2, 0.3337, -1.696e-2]
    circular, plain, helped, against = (ours.state(f"4.3, {name}", error) for name, error in left.items())
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
                [np.array(printed), circular, np.array(printed_eccentric), plain, helped, against],
            ),
            "Effort ∫|u|² dt: "
            + ", ".join(f"{name} {ours(f'4.3, {name}: effort', effort(u))}" for name, (_, u) in flights.items())
            + " m²/s³.",
            "",
            "Circular, both are metres; the time of the table is not printed, and the error passes",
            "through zero several times on its way down. Eccentric, the printed figures are those of",
            "none of the three: x is of the size of ours without feed-forward, y and z are seven and",
            "twenty times it. The printed velocity errors of 14 and 17 m/s exceed the desired",
            "velocities themselves, 9.3 and 6.4 m/s, and a position error of 400 m that changes at such",
            "a rate is no steady one. With the sign that helps, the eccentric chief costs LQR nothing.",
            "",
            "![LQR from 1 to 10 km](seeds_4_3.png)",
            "",
        ]
    )
    sizes = {name: float(np.linalg.norm(error[:3])) for name, error in left.items()}
    gone = sizes["e = 0.15, +"] / sizes["e = 0"]
    return text, [
        Figure("4.3, circular: position error, metres both", "7.4 m", sizes["e = 0"], "m", 1.0, 10.0),
        Figure("4.3: e = 0.15 with feed-forward over e = 0", "55", gone, "", 0.5, 2.0),
    ]


def sdre_thrust(
    known: RelativeModel,
    goal: Orbit,
    factorisation: str,
    weight: float,
    integral: float = 0.0,
    share: float = 1.0,
) -> Callable[..., Array]:
    """SDRE with the known control of (4.13), in the sign that helps; a gain every 10 s.

    Args:
        known: the equations that the law factorises.
        integral: of the position error, m s, that weighs one in (5.7); 0 for (5.6).
        share: of the known control.
    """
    law = Sdre(
        SdreParameters(
            position_error=(1.0,) * 3,
            velocity_error=(1.0,) * 3,
            integral_error=integral,
            thrust=(1.0 / math.sqrt(weight),) * 3,
        ),
        MISSION,
        UNLIMITED,
    )
    kept: list[Array] = []
    total = np.zeros(3 if integral else 0)

    def thrust(time: float, state: Array) -> Array:
        aim = goal.state(time)
        (matrix,), _ = state_dependent(known, factorisation, np.array([time]))(state[None])
        if round(time) % 10 == 0:
            kept[:] = [law.gain(matrix)]
        known_control = (target_rate(goal, time) - matrix @ aim)[3:]
        acceleration = -kept[0] @ np.concatenate([state - aim, total]) + share * known_control
        total[:] += TICK * (state - aim)[: len(total)]
        return np.asarray(acceleration)

    return thrust


covers(
    "Joshi Table 5.1; Table 5.3",
    "control/sdre.py",
    figures=(
        "5.3, R = 10^8: settling to 1 m, as printed",
        "5.3, R = 10^9: settling to 1 m, as printed",
        "5.3, R = 10^10: settling to 1 m, as printed",
        "5.3, R = 10^11: settling to 1 m, as printed",
    ),
    differs=(
        "settling times come out within a third, to a tolerance that is not printed; the efforts follow "
        "from no definition of effort"
    ),
)
covers(
    "Joshi Fig. 5.5; Fig. 5.6",
    "control/sdre.py",
    figures=("5.3, R = 10^9: settling to 1 m, as printed",),
    differs="the plot is lost in the text; ours is seeds_5_3.png, with errors as lengths",
)
covers(
    "Joshi Table 5.2; Table 5.4",
    "control/sdre.py",
    "relative/factorisation.py",
    figures=("5.4: error of method II over I",),
    differs=(
        "method I leaves 5 cm for the 6 m that are printed, method II 67 m for 9.1 m; II is the worse, as the text says"
    ),
)
covers(
    "Joshi Fig. 5.1; Fig. 5.2; Fig. 5.4; Fig. 5.7",
    "control/sdre.py",
    figures=("5.4: error of method II over I",),
    differs="the plot is lost in the text; ours is seeds_5_4.png, with errors as lengths",
)


def sdre_infinite(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Tables 5.3 and 5.4: 5 to 25 km by SDRE."""
    start, goal, last = Orbit(5.0, 45.0, 1.0), Orbit(25.0, 60.0, 1.5), 9000
    goals = goals_of(goal, last)
    lines = [
        "## Table 5.3: SDRE, 5 to 25 km about a circular chief",
        "",
        "| R | settling time, printed | ours, to 10 m | to 1 m | effort, printed, 10⁻² | "
        "∫\\|u\\|² dt, m²/s³ | ∫\\|u\\| dt, m/s |",
        "|---|---|---|---|---|---|---|",
    ]
    printed = {1e8: (1500, 4.19), 1e9: (2000, 4.12), 1e10: (5000, 3.58), 1e11: (7500, 3.02)}
    figures, flights = [], {}
    for weight, (settling, printed_effort) in printed.items():
        plant, name = model(0.0), f"R = 10^{math.log10(weight):.0f}"
        flights[name] = fly(plant, start.state(0.0), sdre_thrust(plant, goal, "sdc1", weight), last)
        states, accelerations = flights[name]
        off = np.linalg.norm((states - goals)[:, :3], axis=1)
        settled = [int(np.nonzero(off > limit)[0][-1]) + 1 for limit in SETTLED]
        figures.append(
            Figure(
                f"5.3, {name}: settling to 1 m, as printed",
                f"{settling} s",
                settled[1],
                "s",
                0.7 * settling,
                1.4 * settling,
            )
        )
        words = [
            ours(f"5.3, {name}: settling to {limit:g} m", time, "d", "s", TICK)
            for limit, time in zip(SETTLED, settled, strict=True)
        ]
        spent = ours(f"5.3, {name}: effort", effort(accelerations), ".4g", "m²/s³")
        sum_of = float(np.linalg.norm(accelerations, axis=1).sum()) * TICK
        lines.append(
            f"| {name[4:]} | {settling} s | {words[0]} s | {words[1]} s | {printed_effort} | {spent} | "
            f"{ours(f'5.3, {name}: integral of |u|', sum_of, '.4g', 'm/s')} |"
        )
    picture(directory / "seeds_5_3.png", "Figs 5.5, 5.6: SDRE, 5 to 25 km, e = 0", flights, goals)
    lines += [
        "",
        "Settling times may be off by a second. Those printed, to a tolerance that is not, are within a",
        "third or so of ours to 1 m. The printed efforts change by a factor of 1.4 while R changes by a",
        "thousand. Ours change by 170 as ∫|u|² dt, by 13 as its root and by 5.3 as",
        "∫|u| dt. None can change by as little as is printed: over the same distance d in a time T, |u|",
        "is of the size d/T² and ∫|u| dt of d/T, and T itself, printed and ours, changes by five.",
        "",
        "![SDRE from 5 to 25 km, e = 0](seeds_5_3.png)",
        "",
    ]

    plant, final = model(0.15), 4000
    flights = {
        name: fly(plant, start.state(0.0), sdre_thrust(plant, goal, factorisation, 1e9), final)
        for name, factorisation in (("method I", "sdc1"), ("method II", "sdc2"))
    }
    left = {name: states[-1] - goals[final] for name, (states, _) in flights.items()}
    picture(
        directory / "seeds_5_4.png",
        "Figs 5.1-5.4, 5.7: SDRE, 5 to 25 km, e = 0.15",
        flights,
        goals[: final + 1],
    )
    one, two = (float(np.linalg.norm(error[:3])) for error in left.values())
    words = [ours.state(f"5.4, {name}", error) for name, error in left.items()]
    lines += [
        "## Table 5.4: SDRE about an eccentric chief, methods I and II",
        "",
        "e = 0.15, R = 10⁹ I, after the 4000 s of Fig. 5.7.",
        "",
        table(
            ["I, printed", "I, ours", "II, printed", "II, ours"],
            [
                np.array([0.0003, 2.45e-6, -0.00096, -1.47e-6, -0.005931, 9.312e-6]),
                words[0],
                np.array([0.0085, -5.3e-5, 0.002985, 2.95e-5, -0.0011, -3.013e-5]),
                words[1],
            ],
        ),
        "Effort ∫|u|² dt: "
        + ", ".join(f"{name} {ours(f'5.4, {name}: effort', effort(u))}" for name, (_, u) in flights.items())
        + " m²/s³.",
        "",
        f"Method I leaves {100.0 * one:.0f} cm here and 6.0 m as printed: with the known control of",
        "(4.13) in the sign that helps, only the transient is left. Method II takes the square of the",
        f"chief's rate for μ/r³ and leaves out its angular acceleration, and keeps {two:.0f} m for that",
        "(printed: 9.1 m). It is the worse of the two by more than an order, as the text says; how much",
        "depends on where the chief is on its ellipse.",
        "",
        "![SDRE from 5 to 25 km, e = 0.15](seeds_5_4.png)",
        "",
    ]
    figures.append(Figure("5.4: error of method II over I", "one order", two / one, "", 10.0, math.inf))
    return "\n".join(lines), figures


def sdre_forms(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """What his tables leave out: J2 in A(x), and the integral of (5.7)."""
    start, goal, last, steep = Orbit(5.0, 45.0, 1.0), Orbit(25.0, 60.0, 1.5), 9000, math.radians(60.0)
    plant, plain, goals = OblateModel(chief(0.15, steep)), model(0.15, steep), goals_of(goal, last)
    lines = [
        "## SDRE with J2 in A(x), and with the integral of (5.7)",
        "",
        "No table shows them. The flight of Table 5.4 about a chief at i = 60° and under J2, which A(x) has",
        "(SDC1 with J2, 5.4) or has not; an integral of 500 m s weighs as much as 1 m. Errors of position.",
        "",
        "| A(x) | integral | after 4000 s, m | greatest from 6000 to 9000 s, m | effort, m²/s³ |",
        "|---|---|---|---|---|",
    ]
    kept = {}
    for known, factorisation in ((plant, "sdc1"), (plain, "sdc1"), (plain, "sdc2")):
        for integral in (0.0, 500.0):
            law = sdre_thrust(known, goal, factorisation, 1e9, integral)
            states, accelerations = fly(plant, start.state(0.0), law, last)
            off = np.linalg.norm((states - goals)[:, :3], axis=1)
            form = factorisation.upper() + (" with J2" if known is plant else "")
            name = f"SDRE on {form}, {'with' if integral else 'no'} integral"
            kept[form, integral] = float(off[6000:].max())
            lines.append(
                f"| {form} | {'yes' if integral else 'no'} | "
                f"{ours(f'{name}: after 4000 s', off[4000], '.4g', 'm')} | "
                f"{ours(f'{name}: greatest later', kept[form, integral], '.4g', 'm')} | "
                f"{ours(f'{name}: effort', effort(accelerations), '.4g', 'm²/s³')} |"
            )
    unknown = kept["SDC1", 0.0] / kept["SDC1 with J2", 0.0]
    integrated = kept["SDC2", 500.0] / kept["SDC2", 0.0]
    lines += [
        "",
        "J2 in A(x) is worth metres at 25 km, and nothing but the transient is left with it. The integral",
        "takes away most of a lasting error that A(x) does not know, here that of SDC2; it pays with a",
        "transient that is longer and twice as dear, since it sums up the leap of the target as well.",
        "",
    ]
    return "\n".join(lines), [
        Figure("SDRE: lasting error without J2 in A(x), over that with it", "", unknown, "", 10.0, math.inf),
        Figure("SDRE: lasting error of SDC2 with the integral, over that without", "", integrated, "", 0.0, 0.5),
    ]


covers(
    "Joshi Table 5.5; Table 5.6",
    "control/sdre_finite.py",
    figures=("5.6 (c): greatest position error, below 1 mm/km of way",),
    differs=(
        "solved for the time to go the end is met; the printed kilometres are those of matrices kept "
        "from t₀, and the hundreds of method II come from no reading"
    ),
)
covers(
    "Joshi Fig. 5.8; Fig. 5.9; Fig. 5.10; Fig. 5.11; Fig. 5.12; Fig. 5.13; Fig. 5.14; Fig. 5.15",
    "control/sdre_finite.py",
    figures=("5.6 (c): greatest position error, below 1 mm/km of way",),
    differs=("the plot is lost in the text; ours are seeds_5_6_00.png and seeds_5_6_05.png, with errors as lengths"),
)


def finite(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
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
        "second for the time to go, from the state of now, which alone is frozen: the chief's motion to come",
        "is known.",
        "",
    ]
    goals, met, pictures = goals_of(goal, final), [], []
    for eccentricity in (0.0, 0.05, 0.15):
        heading, columns, efforts, flights = [], list[Array | list[str]](), [], {}
        for factorisation in ("sdc1", "sdc2"):
            plant = model(eccentricity)
            heading.append(f"{factorisation}, printed")
            columns.append(np.array(printed[eccentricity, factorisation]))
            for reading, thrust in (
                ("a", from_start(plant, factorisation, start, goal, final, anew=False)),
                ("b", from_start(plant, factorisation, start, goal, final, anew=True)),
                ("c", to_go(plant, factorisation, goal, final)),
            ):
                name = f"{factorisation} ({reading})"
                flights[name] = fly(plant, start.state(0.0), thrust, final)
                states, accelerations = flights[name]
                label = f"5.6, e = {eccentricity:g}, {name}"
                heading.append(f"({reading})")
                columns.append(ours.state(label, states[-1] - goals[-1]))
                spent = ours(f"{label}: effort", effort(accelerations), ".4g", "m²/s³")
                efforts.append(f"{name} {spent}")
                if reading == "c":
                    met.append(float(np.linalg.norm((states[-1] - goals[-1])[:3])))
        file = f"seeds_5_6_{100.0 * eccentricity:02.0f}.png"
        picture(directory / file, f"finite-time SDRE, 10 to 100 km, e = {eccentricity:g}", flights, goals)
        pictures.append(f"![Finite-time SDRE, e = {eccentricity:g}]({file})")
        lines += [
            f"### e = {eccentricity:g}",
            "",
            table(heading, columns),
            "Effort ∫|u|² dt: " + ", ".join(efforts) + " m²/s³.",
            "",
        ]
    lines += [
        "With the time to go the end is met, by either factorisation. The printed kilometres of method",
        "I are those of readings (a) and (b), in which nothing is fed back: (a) never looks at the",
        "state again, (b) only through the matrices. Method II is the worse the more eccentric the",
        "chief is, printed and ours; the printed hundreds of kilometres, though, are more than the",
        "formation's size, and no reading gives them. For e = 0 both methods factorise the same",
        "equations, and ours agree; the printed ones differ by up to 350 m, the z component by 190 m,",
        "though its equation is the same in both.",
        "",
        *(line for each in pictures for line in (each, "")),
    ]
    return "\n".join(lines), [
        Figure("5.6 (c): greatest position error, below 1 mm/km of way", "0.8 to 295 km", max(met), "m", 0.0, 0.1)
    ]


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
    return joined(directory, lqr, sdre_infinite, sdre_forms, finite)
