"""The truth against programs that are not ours, its conserved quantities, and the disturbances at GEO.

`main` writes `dynamics.md` and its plots, and returns the number of figures outside their tolerance.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from verification.coverage.marker import covers
from verification.figure import TABLE, Figure, failures
from verification.independent import Basilisk, Heyoka, Places, jpl, series

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]

DAY = 86400.0
EPOCH = 7.9e8
"""13 January 2025, TT since J2000.0, s: an arbitrary instant."""

ORBITS = {
    "LEO": Elements(6978.1e3, 0.001, np.radians(85.0), 0.3, 0.2, 0.1),
    "GEO": Elements(42164.2e3, 0.0002, np.radians(0.1), 0.3, 0.2, 0.1),
    "eccentric": Elements(24e6, 0.7, np.radians(50.0), 0.3, 0.2, 0.1),
}
LOW = Elements(EARTH_RADIUS + 425e3, 0.0005, 0.0, 0.3, 0.2, 0.1)
"""Equatorial, within one band of the atmosphere's table: all that Basilisk's exponential atmosphere has."""

LAST_QUARTER = 8206.63 * DAY
"""21 June 2022, 03:08 UTC: the Sun on the inertial y axis and the Moon, at its last quarter, on x."""

BODY = Body(mass=50.0, area=2.0)
ROUNDING = 1e-4
"""Tolerance where both programs solve the same equations, m after a day; the requirement is 1 mm."""


def fly(orbit: Elements, forces: Forces, tick: float = 1.0, duration: float = DAY, epoch: float = EPOCH) -> Array:
    """Our state after a duration, flown tick by tick as the plant does."""
    propagator = Propagator(tick, 1, forces, (BODY,), epoch)
    states, thrust = state_from_elements(orbit)[None], np.zeros((1, 3))
    for k in range(round(duration / tick)):
        states = propagator.propagate(k * tick, states, thrust)
    return states[0]


def apart(one: Array, other: Array) -> float:
    """Distance of two states, m."""
    return float(np.linalg.norm((one - other)[:3]))


def number(value: float) -> str:
    """A length in m for a table."""
    return f"{value:.2g}" if value < 1.0 else f"{value:,.1f}"


def gravity_against_heyoka(directory: Path) -> tuple[str, list[Figure]]:
    """Central attraction, zonals and EGM2008 against Taylor integration in extended precision."""
    cases: dict[str, tuple[Forces, type]] = {
        "central": (Forces(zonal_degree=0), np.longdouble),
        "J2": (Forces(zonal_degree=2), np.longdouble),
        "J2 to J6": (Forces(zonal_degree=6), np.longdouble),
        "EGM2008, 20 x 20": (Forces(harmonics_degree=20), np.float64),
    }
    figures = []
    rows = []
    for name, (forces, precision) in cases.items():
        theirs = Heyoka(forces, EPOCH, precision)
        found = []
        for place, orbit in ORBITS.items():
            difference = apart(fly(orbit, forces), theirs.fly(state_from_elements(orbit), DAY))
            found.append(difference)
            figures.append(
                Figure(f"{name}, {place}, heyoka", "below 1 mm", difference * 1e3, "mm", 0.0, ROUNDING * 1e3)
            )
        rows.append(f"| {name} | " + " | ".join(f"{value * 1e6:.1f}" for value in found) + " |")
    ticks = (1.0, 10.0, 30.0, 60.0, 120.0)
    truth = {place: Heyoka(Forces(), EPOCH).fly(state_from_elements(orbit), DAY) for place, orbit in ORBITS.items()}
    steps = {place: [apart(fly(orbit, Forces(), t), truth[place]) for t in ticks] for place, orbit in ORBITS.items()}
    text = f"""## Gravity against heyoka

heyoka integrates the same potential, differentiated by itself, by Taylor series; in extended precision,
except for EGM2008, whose coefficients and recursion are its own. Ours flies at ticks of 1 s. Position
difference after one day, **micrometres**:

| force | {" | ".join(ORBITS)} |
|---|{"---|" * len(ORBITS)}
{chr(10).join(rows)}

What is left is our rounding, about 1e-9 m in each of 86,400 steps. With longer steps (J2), m:

| step | {" | ".join(ORBITS)} |
|---|{"---|" * len(ORBITS)}
"""
    for index, tick in enumerate(ticks):
        text += f"| {tick:.0f} s | " + " | ".join(number(steps[place][index]) for place in ORBITS) + " |\n"
    return text, figures


def forces_against_basilisk(directory: Path) -> tuple[str, list[Figure]]:
    """Every force against Basilisk."""
    plain = {place: fly(orbit, Forces()) for place, orbit in ORBITS.items()} | {"low": fly(LOW, Forces())}
    figures: list[Figure] = []
    rows: list[str] = []

    def compare(
        name: str,
        place: str,
        forces: Forces,
        step: float,
        tolerance: float,
        why: str,
        places: Places = series,
    ) -> None:
        orbit = LOW if place == "low" else ORBITS[place]
        ours = fly(orbit, forces)
        theirs = Basilisk(forces, EPOCH, state_from_elements(orbit)[None], step, BODY, places).fly(DAY)[0]
        difference, effect = apart(ours, theirs), apart(ours, plain[place])
        figures.append(Figure(f"{name}, {place}, Basilisk at {step:.0f} s", "", difference, "m", 0.0, tolerance))
        rows.append(f"| {name} | {place} | {number(effect)} | {step:.0f} | {number(difference)} | {why} |")

    held = "Basilisk holds shadow, density and wind over a step"
    for place in ORBITS:
        compare("J2 to J6", place, Forces(zonal_degree=6), 10.0, ROUNDING, "rounding")
    for place in ORBITS:
        compare("Sun", place, Forces(sun=True), 10.0, ROUNDING, "rounding")
        compare("Moon", place, Forces(moon=True), 10.0, ROUNDING, "rounding")
    ephemeris = {"LEO": 0.1, "GEO": 15.0, "eccentric": 2.0}
    for place in ORBITS:
        compare(
            "Sun and Moon, theirs from DE421",
            place,
            Forces(sun=True, moon=True),
            10.0,
            ephemeris[place],
            "our series for Sun and Moon, 0.1 deg",
            jpl(),
        )
    turning = "Basilisk holds the Earth's orientation over a step"
    compare("EGM2008, 20 x 20", "LEO", Forces(harmonics_degree=20), 10.0, 0.1, turning)
    compare("EGM2008, 20 x 20", "LEO", Forces(harmonics_degree=20), 1.0, 1e-3, turning + ": second order")
    compare("EGM2008, 20 x 20", "GEO", Forces(harmonics_degree=20), 10.0, 1e-3, turning)
    compare("EGM2008, 20 x 20", "eccentric", Forces(harmonics_degree=20), 10.0, 0.1, turning)
    sunlight = Forces(radiation_pressure=True)
    compare("sunlight", "LEO", sunlight, 10.0, 2.0, held)
    compare("sunlight", "LEO", sunlight, 1.0, 0.2, held + ": first order")
    compare("sunlight", "GEO", sunlight, 10.0, 0.01, "Basilisk holds the Sun's place over a step")
    compare("sunlight", "eccentric", sunlight, 10.0, 0.5, held)
    compare("drag", "low", Forces(drag=True), 10.0, 2.0, held)
    compare("drag", "low", Forces(drag=True), 1.0, 0.2, held + ": first order")
    everything = Forces(harmonics_degree=20, sun=True, moon=True, radiation_pressure=True, drag=True)
    compare("all", "low", everything, 1.0, 1.0, held)
    text = f"""## Every force against Basilisk

Basilisk flies its own spacecraft, gravity, radiation, eclipse, atmosphere and drag modules with an adaptive
Runge-Kutta-Fehlberg 7(8) at a relative tolerance of 1e-14 inside its step; J2 is on throughout, the body
weighs {BODY.mass:.0f} kg and has {BODY.area:.0f} m^2. Sun, Moon and the Earth's rotation come by message.
`effect` is what the force does to our orbit in a day beside J2 alone, `difference` how far the two programs
are apart after it, m:

| force | orbit | effect | Basilisk's step, s | difference | what the difference is |
|---|---|---|---|---|---|
{chr(10).join(rows)}

`low` is equatorial at 425 km, inside the one exponential band that Basilisk's atmosphere has. Basilisk
extrapolates a planet's orientation within a step as a matrix plus its rate of change, which is no rotation:
it stretches positions by (w dt)^2 / 2, and costs 1.3 m a day in LEO at steps of 1 s, 131 m at 10 s. Here it
is given the orientation in mid-step and no rate.
"""
    return text, figures


def conservation(directory: Path) -> tuple[str, list[Figure]]:
    """Energy and angular momentum over ten days."""
    ticks, every = 864_000, 864
    plot, charts = plt.subplots(1, 2, figsize=(11, 4), sharey=True)
    figures = []
    rows = []
    for chart, (name, degree) in zip(charts, (("central", 0), ("J2", 2)), strict=True):
        strength = J2 if degree else 0.0
        for place, orbit in ORBITS.items():
            propagator, thrust = Propagator(1.0, forces=Forces(zonal_degree=degree)), np.zeros((1, 3))
            states, history = state_from_elements(orbit)[None], []
            for k in range(ticks + 1):
                if k % every == 0:
                    history.append(states[0])
                states = propagator.propagate(float(k), states, thrust)
            flown = np.array(history)
            radius = np.linalg.norm(flown[:, :3], axis=1)
            oblate = strength * (EARTH_RADIUS / radius) ** 2 * (3 * (flown[:, 2] / radius) ** 2 - 1) / 2
            energy = np.sum(flown[:, 3:] ** 2, axis=1) / 2 - MU / radius * (1 - oblate)
            momentum = np.cross(flown[:, :3], flown[:, 3:])[:, 2]
            lost, turned = (np.abs(v / v[0] - 1) for v in (energy, momentum))
            chart.semilogy(np.arange(len(lost)) * every / DAY, lost + 1e-17, label=f"{place}, energy", lw=0.8)
            figures.append(Figure(f"energy, {name}, {place}, 10 days", "conserved", lost.max(), "", 0.0, 1e-12))
            figures.append(Figure(f"h_z, {name}, {place}, 10 days", "conserved", turned.max(), "", 0.0, 1e-12))
            rows.append(f"| {name} | {place} | {lost.max():.1e} | {turned.max():.1e} |")
        chart.set(title=name, xlabel="days")
        chart.grid(alpha=0.3)
    charts[0].set_ylabel("relative change of energy")
    charts[0].legend(fontsize=8)
    plot.tight_layout()
    plot.savefig(directory / "dynamics_energy.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    text = f"""## What is conserved

Largest relative change, over ten days at ticks of 1 s, of the energy and of the angular momentum about the
Earth's axis:

| force | orbit | energy | momentum |
|---|---|---|---|
{chr(10).join(rows)}

![Energy](dynamics_energy.png)
"""
    return text, figures


covers(
    "Neokleous Fig. 2.4",
    "orbit/forces/zonal.py",
    figures=("J2 at GEO, largest change of radius",),
    differs=("the plot is lost in the text; ours is dynamics_geo.png, from a Kepler orbit, his from one with J2 in it"),
)
covers(
    "Neokleous Fig. 2.9",
    "orbit/forces/third_body.py",
    figures=("Fig. 2.9, Moon, after two days",),
    differs=(
        "the plot is lost in the text; ours is dynamics_geo.png, beside Basilisk; his (2.22) makes the "
        "difference of two attractions vanish"
    ),
)
covers(
    "Neokleous Fig. 2.10",
    "orbit/forces/third_body.py",
    figures=("Fig. 2.10, Sun, after two days",),
    differs=(
        "the plot is lost in the text; ours is dynamics_geo.png, beside Basilisk; his (2.22) makes the "
        "difference of two attractions vanish"
    ),
)
covers(
    "Neokleous Fig. 2.12",
    "orbit/forces/third_body.py",
    figures=("Fig. 2.12, J2, Moon and Sun, after two days",),
    differs=(
        "the plot is lost in the text; ours is dynamics_geo.png, beside Basilisk; his (2.22) makes the "
        "difference of two attractions vanish"
    ),
)
covers(
    (
        "Neokleous Fig. 1.1; Fig. 2.1; Fig. 2.2; Fig. 2.3; Fig. 2.5; Fig. 2.6; Fig. 2.7; Fig. 2.8; Fig. "
        "2.11; Fig. 3.1; Fig. 3.2; Fig. 4.1; Fig. 5.1; Fig. 5.2; Fig. 5.3; Fig. 5.4; Fig. 5.5; Fig. 5.6; Fig. 5.7"
    ),
    impossible="a drawing, with nothing to compute",
)


def neokleous(directory: Path) -> tuple[str, list[Figure]]:
    """The disturbances at GEO over two days: Neokleous' Figs. 2.4, 2.9, 2.10 and 2.12."""
    epoch, duration, tick = LAST_QUARTER, 2 * DAY, 60.0
    radius = 42164.2e3
    chief = state_from_elements(Elements(radius, 0.0, 0.0, 0.0, 0.0, 0.0))
    none = Forces(zonal_degree=0)
    cases = {
        "Fig. 2.4, J2": Forces(),
        "Fig. 2.9, Moon": replace(none, moon=True),
        "Fig. 2.10, Sun": replace(none, sun=True),
        "Fig. 2.12, J2, Moon and Sun": Forces(sun=True, moon=True),
    }
    plot, charts = plt.subplots(2, 4, figsize=(15, 6), sharex=True)
    figures = []
    rows = []
    for column, (name, forces) in enumerate(cases.items()):
        real, ideal = Propagator(tick, 6, forces, epoch=epoch), Propagator(tick, 6, none)
        states, reference, thrust = chief[None], chief[None], np.zeros((1, 3))
        relative, change = [], []
        for k in range(round(duration / tick) + 1):
            relative.append(relative_from_inertial(reference[0], states[0])[:3])
            change.append(np.linalg.norm(states[0, :3]) - radius)
            states = real.propagate(k * tick, states, thrust)
            reference = ideal.propagate(k * tick, reference, thrust)
        minutes = np.arange(len(change)) * tick / 60.0
        charts[0, column].plot(minutes, np.array(change) / 1e3, color="black")
        charts[0, column].set_title(name, fontsize=10)
        for axis, label in enumerate(("radial", "along-track", "cross-track")):
            charts[1, column].plot(minutes, np.array(relative)[:, axis] / 1e3, label=label)
        charts[1, column].set_xlabel("minutes")
        for chart in charts[:, column]:
            chart.grid(alpha=0.3)
        extent = np.abs(relative).max(axis=0) / 1e3
        rows.append(f"| {name} | {np.ptp(change) / 1e3:.3f} | " + " | ".join(f"{v:.3f}" for v in extent) + " |")
        if column == 0:
            # From rest in Hill's equations under the constant pull a = 3/2 mu J2 R^2 / r^4:
            # x = -(a / n^2)(1 - cos nt), at most 2 a / n^2 = 3 J2 R^2 / r inwards.
            expected = 3 * J2 * EARTH_RADIUS**2 / radius / 1e3
            figures.append(
                Figure(
                    "J2 at GEO, largest change of radius",
                    f"{expected:.3f} km",
                    np.ptp(change) / 1e3,
                    "km",
                    0.99 * expected,
                    1.01 * expected,
                )
            )
            figures.append(Figure("J2 at GEO, cross-track", "0", float(extent[2]), "km", 0.0, 1e-9))
        else:
            theirs = Basilisk(forces, epoch, chief[None], 10.0, BODY, jpl()).fly(duration + tick)[0]
            difference = apart(states[0], theirs)
            figures.append(Figure(f"{name}, after two days", "Basilisk with DE421", difference, "m", 0.0, 60.0))
    charts[0, 0].set_ylabel("change of radius, km")
    charts[1, 0].set_ylabel("relative to the ideal orbit, km")
    charts[1, 0].legend(fontsize=8)
    plot.tight_layout()
    plot.savefig(directory / "dynamics_geo.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    text = f"""## Neokleous, Figs. 2.4, 2.9, 2.10 and 2.12: disturbances at GEO over two days

A geostationary satellite starts on the ideal (two-body) orbit, on the inertial x axis, and is disturbed. His
day is a 21 June with the Sun on y and the Moon on x; here it is that of 2022, at the last quarter of the
Moon. His figures survive only as captions, so there is no printed number to set beside ours:

| figure | change of radius, km | radial, km | along-track, km | cross-track, km |
|---|---|---|---|---|
{chr(10).join(rows)}

![Disturbances at GEO](dynamics_geo.png)

Two things of his model are not followed. His ideal orbit for Fig. 2.4 contains J2 itself (2.18), so that a
satellite at rest stays at rest; ours is Kepler's, and the satellite swings inwards by 3 J2 R^2 / r. And his
(2.22) counts the Moon's direction and distance from the Earth's centre, with which his own (2.9), the
difference of two attractions, vanishes; ours keeps it whole.
"""
    return text, figures


Section = Callable[[Path], tuple[str, list[Figure]]]
SECTIONS: tuple[Section, ...] = (gravity_against_heyoka, forces_against_basilisk, conservation, neokleous)


def main(directory: Path) -> int:
    """Write the page and its plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    texts, figures = [], []
    for section in SECTIONS:
        text, limits = section(directory)
        texts.append(text)
        figures += limits
    heading = (
        "# Dynamics\n\nWritten by `verification/dynamics.py`. The relative-motion models have "
        "[a page of their own](relative_motion.md); the equations are in [orbits](../theory/orbits.md).\n"
    )
    verdicts = "## Stated tolerances\n\n" + "\n".join([TABLE, *(figure.row for figure in figures)]) + "\n"
    (directory / "dynamics.md").write_text("\n".join([heading, *texts, verdicts]))
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
