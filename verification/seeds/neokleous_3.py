"""Neokleous' Figs. 3.3 to 3.6 with their velocity panels and details, and his thruster equation (2.27)."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.common import Orbit
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.plant.thrusters import STANDARD_GRAVITY, Thruster, ThrusterParameters
from formation_gnc.sil.monte_carlo import navigation_filter, simulate_measurements
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours

PAGE = "neokleous"

Array = NDArray[np.float64]

GEO = Orbit(42164e3)
START = np.array([500.0, 1000.0, 300.0, 0.0, -2.0 * 7.292e-5 * 500.0, 0.0])
NAMES = ("x", "y", "z", "x'", "y'", "z'")
DETAILS = {"A": slice(0, 300), "B": slice(5000, 5300)}
"""Ticks of his regions A and B, which are not printed: the first half hour, and one in the middle."""


covers(
    "Neokleous Fig. 3.3",
    "navigation/navigation_filter.py",
    figures=("Fig. 3.3: RMS error of x, over a reading's noise", "Fig. 3.3: RMS error of x', over a reading's noise"),
    differs="start and noise are not printed; the plot is lost in the text; ours is neokleous_3.png",
)
covers(
    "Neokleous Fig. 3.4",
    "navigation/navigation_filter.py",
    figures=("Fig. 3.4: error of y at the end over its start", "Fig. 3.4: RMS error of y', over a reading's noise"),
    differs="y is not observable: its error stays as the fix left it; the plot is lost in the text; ours is "
    "neokleous_3.png",
)
covers(
    "Neokleous Fig. 3.5",
    "navigation/navigation_filter.py",
    figures=("Fig. 3.5: RMS error of z, over a reading's noise", "Fig. 3.5: RMS error of z', over a reading's noise"),
    differs="start and noise are not printed; the plot is lost in the text; ours is neokleous_3.png",
)
covers(
    "Neokleous Fig. 3.6",
    "navigation/navigation_filter.py",
    figures=("Fig. 3.6: RMS error of r2, over a reading's noise",),
    differs="start and noise are not printed; the plot is lost in the text; ours is neokleous_3.png",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """The filter's estimates beside the truth, and the nozzle."""
    parameters = NavigationParameters(
        chief=GEO,
        tick=6.0,
        pseudo_measurements=True,
        acceleration_density=1e-14,
        fix_position_sigma=50.0,
        fix_velocity_sigma=0.02,
    )
    filter, ours = navigation_filter(parameters), Ours()
    truth, found, radius = [], [], []
    for sample in simulate_measurements(parameters, 10000, np.random.default_rng(33), start=START):
        estimate = filter.on_tick(sample.measurement)
        assert estimate is not None
        truth.append(sample.truth)
        found.append(estimate.relative_state)
        chief = float(np.linalg.norm(estimate.chief_state[:3]))
        lengths = [
            np.linalg.norm(each[:3] + np.array([chief, 0.0, 0.0])) for each in (sample.truth, estimate.relative_state)
        ]
        radius.append([float(sample.measurement.readings[0].values[0]), *lengths])
    true, states, radii = map(np.array, (truth, found, radius))
    draw(true, states, radii, directory / "neokleous_3.png")
    error = (states - true)[len(true) // 2 :]
    rms = np.sqrt(np.mean(error**2, axis=0))
    noise = np.array([5.0, 42.164, 42.164, 0.01, 0.01, 0.01])
    left = float(np.sqrt(np.mean((radii[5000:, 2] - radii[5000:, 1]) ** 2)))
    lines = [
        "## Chapter 3: the filter's estimates",
        "",
        "As in [navigation](navigation.md#neokleous-figs-33-to-36), with the panels of the rates and the",
        "details: radius,",
        "range rate and latitude every 0.1 min over 1000 min (5 m, 1 cm/s, 1e-6 rad). RMS error, second half:",
        "",
        "| x, m | y, m | z, m | x', mm/s | y', mm/s | z', mm/s | r2, m |",
        "|---|---|---|---|---|---|---|",
        "| "
        + " | ".join(
            ours(f"Figs. 3.3-3.6: {name}", value * (1e3 if "'" in name else 1.0), ".3g")
            for name, value in zip(NAMES, rms, strict=True)
        )
        + f" | {ours('Figs. 3.3-3.6: r2', left, '.3g')} |",
        "",
        "![States and rates](neokleous_3.png)",
        "",
    ]
    kept = float((states - true)[-1, 1] / (states - true)[0, 1])
    figures = [
        *(
            Figure(
                f"{figure}: RMS error of {NAMES[i]}, over a reading's noise", "follows", rms[i] / noise[i], "", 0.0, 0.2
            )
            for figure, i in (("Fig. 3.3", 0), ("Fig. 3.3", 3), ("Fig. 3.4", 4), ("Fig. 3.5", 2), ("Fig. 3.5", 5))
        ),
        Figure("Fig. 3.4: error of y at the end over its start", "follows (towards 0)", kept, "", 0.95, 1.05),
        Figure("Fig. 3.6: RMS error of r2, over a reading's noise", "follows", left / 5.0, "", 0.0, 0.2),
    ]
    text, more = nozzle(ours)
    return "\n".join([*lines, text]), [*figures, *more, *ours.cells]


def draw(true: Array, found: Array, radii: Array, path: Path) -> None:
    """States, rates and details A and B for each axis; radius and its detail."""
    plot, panels = plt.subplots(4, 4, figsize=(20, 15))
    minutes = 0.1 * np.arange(len(true))
    for i, row in enumerate(panels[:3]):
        for column, (state, part, name) in enumerate(
            (
                (i, slice(None), NAMES[i]),
                (i + 3, slice(None), NAMES[i + 3]),
                (i, DETAILS["A"], f"{NAMES[i]}, detail A"),
                (i + 3, DETAILS["B"], f"{NAMES[i + 3]}, detail B"),
            )
        ):
            row[column].plot(minutes[part], true[part, state], "k", lw=2.0, label="true")
            row[column].plot(minutes[part], found[part, state], "tab:orange", lw=1.0, label="estimated")
            row[column].set(ylabel="m" if state < 3 else "m/s", xlabel="min", title=f"Fig. 3.{i + 3}: {name}")
    panels[0, 0].legend()
    for panel, part in ((panels[3, 0], slice(None)), (panels[3, 1], DETAILS["A"])):
        panel.plot(minutes[part], radii[part, 0] - 42164e3, ".", color="0.7", ms=2, label="measured")
        panel.plot(minutes[part], radii[part, 2] - 42164e3, "tab:orange", label="estimated")
        panel.set(ylabel="r2 - 42164 km, m", xlabel="min", title="Fig. 3.6")
        panel.legend()
    for panel in panels[3, 2:]:
        panel.set_axis_off()
    save(plot, path)


covers(
    "Neokleous (2.27); (6.1), (6.2)",
    "plant/thrusters.py",
    figures=("(2.27), (2.28): propellant of the plant over that of the nozzle",),
    differs="the plant knows (2.28) alone: exhaust velocity and pressure term are in its specific impulse",
)


def nozzle(ours: Ours) -> tuple[str, list[Figure]]:
    """(2.27) with its pressure term, and what the plant uses of propellant with the specific impulse of (2.28)."""
    flow, velocity, area, exit_pressure, ambient, duration = 0.005, 2800.0, 4e-4, 2.5e3, 0.0, 100.0
    force = velocity * flow + area * (exit_pressure - ambient)
    impulse = force / (STANDARD_GRAVITY * flow)
    parameters = ThrusterParameters(limit=(20.0,) * 3, specific_impulse=impulse)
    thruster = Thruster(parameters, duration, np.random.default_rng(0))
    _, after, _ = thruster.apply([force, 0.0, 0.0], False, thruster.start(1000.0))
    used = 1000.0 - after.mass
    words = [
        ours("(2.27): thrust", force, ".4g", "N"),
        ours("(2.27): pressure term", area * (exit_pressure - ambient), ".3g", "N"),
        ours("(2.28): specific impulse", impulse, ".4g", "s"),
    ]
    text = "\n".join(
        [
            "## The thruster (2.27), (2.28)",
            "",
            f"A nozzle of 4 cm², 2800 m/s, 5 g/s and 2.5 kPa at its exit pushes with {words[0]} N, of which",
            f"{words[1]} N",
            f"are the pressure's, and has a specific impulse of {words[2]} s. It is that that the plant is given,",
            "and with it",
            "a thrust of 100 s takes from the tank what the flow does, but for the rocket equation's second order.",
            "",
        ]
    )
    return text, [
        Figure(
            "(2.27), (2.28): propellant of the plant over that of the nozzle",
            "1",
            used / (flow * duration),
            "",
            0.999,
            1.001,
        )
    ]
