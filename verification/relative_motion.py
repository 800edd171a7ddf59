"""Relative-motion models against two integrated orbits: Roberts' figures, and all models on one chart.

`main` writes `relative_motion.md` and its plots, and returns the number of figures outside their tolerance.
"""

import itertools
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.gim_alfriend import GimAlfriendModel
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import J2GradientModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.schweighart_sedwick import (
    CircularReference,
    SchweighartSedwickModel,
    SchweighartSedwickNodalModel,
)
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel
from verification.coverage.marker import covers
from verification.figure import TABLE, Figure, failures

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]

ORBITS = 5
NO_THRUST = np.zeros(3)
AXES = ("radial", "along-track", "cross-track")


def advance(state: Array, duration: float) -> Array:
    """Inertial state after a duration (s) under point mass and J2."""
    moved: Array = propagate_with_transition(state, NO_THRUST, duration, max(1, math.ceil(duration / 20.0)))[0]
    return moved


def curvilinear(leader: Array, follower: Array) -> Array:
    """(3,) radial, along-track and cross-track separation in the leader's curvilinear axes, m."""
    place = hill_rotation(leader) @ follower[:3]
    radius, distance = math.sqrt(leader[:3] @ leader[:3]), math.sqrt(place @ place)
    along = radius * math.atan2(place[1], place[0])
    return np.array([distance - radius, along, radius * math.asin(place[2] / distance)])


def on_reference(reference: CircularReference, relative: Array) -> Array:
    """Inertial state from one relative to the moving reference orbit at its node, in curvilinear axes."""
    x, y, z, vx, vy, vz = relative
    assert z == vz == 0.0
    angle, distance = y / reference.radius, reference.radius + x
    cos_i, sin_i = math.cos(reference.inclination), math.sin(reference.inclination)
    out = np.array([math.cos(angle), math.sin(angle) * cos_i, math.sin(angle) * sin_i])
    ahead = np.array([-math.sin(angle), math.cos(angle) * cos_i, math.cos(angle) * sin_i])
    return np.concatenate((distance * out, vx * out + (distance * reference.rate + vy) * ahead))


def leader_and_follower(reference: CircularReference, relative: Array, times: Array) -> Array:
    """(N, 3) truth of Roberts' comparison: both start with (29), the follower with `relative` more."""
    start = SchweighartSedwickModel(reference).on_the_equator(np.zeros(6))
    leader, follower = on_reference(reference, start), on_reference(reference, start + relative)
    separations = [curvilinear(leader, follower)]
    for duration in np.diff(times):
        leader, follower = advance(leader, float(duration)), advance(follower, float(duration))
        separations.append(curvilinear(leader, follower))
    return np.array(separations)


def march(model: RelativeModel, start: Array, times: Array) -> Array:
    """(N, ..., 6) states at the times, the first being the start."""
    states = [start]
    for time, following in itertools.pairwise(times.tolist()):
        states.append(model.propagate(time, states[-1], following - time))
    return np.array(states)


covers(
    "Roberts Fig. 7",
    "relative/schweighart_sedwick.py",
    "relative/hill.py",
    figures=(
        "Fig. 7a, Hill, radial",
        "Fig. 7a, Hill, along-track",
        "Fig. 7b, averaged, radial",
        "Fig. 7b, averaged, along-track",
        "Fig. 7, cross-track of the truth",
    ),
)
covers(
    "Roberts Fig. 10",
    "relative/j2_gradient.py",
    figures=(
        "Fig. 10, radial over Hill's",
        "Fig. 10, along-track over Hill's",
    ),
    differs="what the text says of it comes out; the plot is lost in the text; ours is relative_motion_roberts.png",
)
covers(
    "Roberts Fig. 12",
    "relative/j2_gradient.py",
    figures=(
        "Fig. 12, correlation of radial motion",
        "Fig. 12, along-track drift",
        "Fig. 12, cross-track over the truth's",
    ),
    differs="what the text says of it comes out; the plot is lost in the text; ours is relative_motion_roberts.png",
)
covers("Roberts Fig. 1; Fig. 2", impossible="a drawing, with nothing to compute")


def roberts(directory: Path) -> tuple[str, list[Figure]]:
    """Figs. 7, 10 and 12: linear models against the truth over five orbits, 100 m along-track."""
    figures: list[Figure] = []
    lines = ["## Roberts, Figs. 7, 10 and 12", ""]
    charts = []
    for name, radius, degrees, circling in (
        ("sun-synchronous", 7e6, 97.87, True),
        ("MUSTANG", 6978.1e3, 85.0, False),
    ):
        reference = CircularReference(radius, math.radians(degrees))
        n = reference.mean_motion
        times = np.linspace(0.0, ORBITS * math.tau / n, 301)
        averaged = SchweighartSedwickModel(reference)
        beside = np.array([0.0, 100.0, 0.0, 0.0, 0.0, 0.0])
        start = averaged.centred(0.0, beside) if circling else beside
        hill_start = beside + (np.array([0, 0, 0, 0.5 * n * 100.0, 0, 0]) if circling else 0.0)
        truth = leader_and_follower(reference, start, times)
        errors = {
            "Hill": march(HillModel(n), hill_start, times)[:, :3] - truth,
            "Schweighart-Sedwick": march(averaged, start, times)[:, :3] - truth,
            "time-varying J2": march(J2GradientModel(reference), start, times)[:, :3] - truth,
        }
        charts.append((f"{name}, i = {degrees} deg", times * n / math.tau, errors))
        worst = {model: np.abs(error).max(axis=0) for model, error in errors.items()}
        if circling:
            hill, average, varying = worst["Hill"], worst["Schweighart-Sedwick"], worst["time-varying J2"]
            figures += [
                Figure("Fig. 7a, Hill, radial", "0.5 m", hill[0], "m", 0.475, 0.525),
                Figure("Fig. 7a, Hill, along-track", "over 1 m", hill[1], "m", 1.0, 1.1),
                Figure("Fig. 7b, averaged, radial", "approximately 6.5 cm", 100 * average[0], "cm", 6.0, 7.0),
                Figure("Fig. 7b, averaged, along-track", "just over 30 cm", 100 * average[1], "cm", 30.0, 35.0),
                Figure("Fig. 7, cross-track of the truth", "just 2 cm", 100 * average[2], "cm", 1.5, 2.5),
                Figure("Fig. 10, radial over Hill's", "worse (above 1)", varying[0] / hill[0], "", 1.0, 10.0),
                Figure("Fig. 10, along-track over Hill's", "worse (above 1)", varying[1] / hill[1], "", 1.0, 10.0),
            ]
        else:
            shape = np.corrcoef(truth[:, 0], truth[:, 0] + errors["time-varying J2"][:, 0])[0, 1]
            drift = np.polyfit(times, errors["time-varying J2"][:, 1], 1)[0] * times[-1]
            cross = worst["time-varying J2"][2] / np.abs(truth[:, 2]).max()
            figures += [
                Figure("Fig. 12, correlation of radial motion", "captures the shape", shape, "", 0.9, 1.0),
                Figure("Fig. 12, along-track drift", "subject to a drift", abs(drift), "m", 0.1, 1.0),
                Figure(
                    "Fig. 12, cross-track over the truth's",
                    "not captured (above 1)",
                    cross,
                    "",
                    1.0,
                    math.inf,
                ),
            ]
        lines += [
            f"Largest errors over {ORBITS} orbits, {name} (i = {degrees} deg, r = {radius / 1e3:g} km), m:",
            "",
        ]
        lines += ["| model | " + " | ".join(AXES) + " |", "|---|---|---|---|"]
        lines += [f"| {m} | " + " | ".join(f"{value:.4f}" for value in w) + " |" for m, w in worst.items()]
        lines.append("")
    speed = 7e6 * CircularReference(7e6, math.radians(35.0)).mean_motion
    rate = CircularReference(7e6, math.radians(35.0)).rate / CircularReference(7e6, 0.0).mean_motion
    figures.append(
        Figure(
            "extra velocity of the delta-v study, as v (c - 1)",
            "2.584 m/s",
            speed * (rate - 1.0),
            "m/s",
            2.55,
            2.62,
        )
    )
    lines += [TABLE, *(figure.row for figure in figures), ""]
    lines += [
        "Truth: two satellites under J2 alone, both started from the moving reference at its node with (29),",
        "the follower 100 m ahead; Figs. 7 and 10 with the rates of (32) and (33), Fig. 12 without. Hill's",
        "model starts with its own radial rate, n y / 2. The figures themselves are not in the text: where",
        "it gives a word and no number, the figure beside it says what the word is taken to mean. 2.584 m/s",
        "is the correction of the orbital rate; (29) would add another 1.7 m/s.",
        "",
        "![Errors against the truth](relative_motion_roberts.png)",
        "",
    ]
    plot, axes = plt.subplots(len(charts), 3, figsize=(13, 7), sharex=True, squeeze=False)
    for row, (title, orbits, errors) in zip(axes, charts, strict=True):
        for axis, chart in enumerate(row):
            for model, error in errors.items():
                chart.plot(orbits, error[:, axis], label=model, linewidth=0.9)
            chart.set_title(f"{title}: {AXES[axis]}", fontsize=9)
            chart.grid(alpha=0.3)
            chart.set_xlabel("orbits")
        row[0].set_ylabel("model less truth, m")
    axes[0, 0].legend(fontsize=8)
    plot.tight_layout()
    plot.savefig(directory / "relative_motion_roberts.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    return "\n".join(lines), figures


def models_about(elements: Elements, reference: CircularReference) -> dict[str, RelativeModel]:
    """Every model of one chief: the circular ones about the reference, the others by its elements."""
    return {
        "Hill": HillModel(reference.mean_motion),
        "Schweighart-Sedwick": SchweighartSedwickModel(reference),
        "Schweighart-Sedwick, nodal": SchweighartSedwickNodalModel(reference),
        "J2 gradient (Roberts)": J2GradientModel(reference),
        "Tschauner-Hempel": TschaunerHempelModel(KeplerChief.of(elements)),
        "nonlinear, two bodies": NonlinearModel(KeplerChief.of(elements)),
        "Gim-Alfriend": GimAlfriendModel(elements),
        "nonlinear with J2": OblateModel(OblateChief(elements)),
    }


SHAPE = np.array([0.5, 1.0, 0.5, 0.0, 0.0, 0.0])
"""Position of the deputy, in units of the separation; at rest across the track, without drift along it."""


def largest_errors(elements: Elements, reference: CircularReference, separations: Sequence[float]) -> dict[str, Array]:
    """Largest position error (m) over five orbits of each model, for each separation (m)."""
    models = models_about(elements, reference)
    truth = models["nonlinear with J2"]
    assert isinstance(truth, OblateModel)
    starts = np.array([truth.bounded(0.0, size * SHAPE) for size in separations])
    times = np.linspace(0.0, ORBITS * truth.period, 24 * ORBITS + 1)
    chief = truth.chief.inertial(0.0)  # type: ignore[attr-defined]
    deputies = [inertial_from_relative(chief, start) for start in starts]
    exact = [[relative_from_inertial(chief, deputy)[:3] for deputy in deputies]]
    for duration in np.diff(times):
        chief = advance(chief, float(duration))
        deputies = [advance(deputy, float(duration)) for deputy in deputies]
        exact.append([relative_from_inertial(chief, deputy)[:3] for deputy in deputies])
    path = np.array(exact)
    return {
        name: np.linalg.norm(march(model, starts, times)[:, :, :3] - path, axis=2).max(axis=0)
        for name, model in models.items()
    }


def all_models(directory: Path) -> tuple[str, list[Figure]]:
    """Error of every model against separation and eccentricity, over five orbits with J2."""
    perigee, inclination = 7e6, math.radians(50.0)
    separations = np.logspace(1.0, 5.0, 9)
    eccentricities = np.array([1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.6])

    circular = CircularReference(perigee, inclination)
    start = on_reference(circular, SchweighartSedwickModel(circular).on_the_equator(np.zeros(6)))
    by_separation = largest_errors(elements_from_state(start), circular, separations.tolist())
    sweeps = []
    for e in eccentricities:
        orbit = Elements(perigee / (1.0 - e), float(e), inclination, 0.0, math.radians(30.0), math.radians(20.0))
        sweeps.append(largest_errors(orbit, CircularReference.of(orbit), [1e3]))
    by_eccentricity = {name: np.array([sweep[name][0] for sweep in sweeps]) for name in by_separation}

    gim = by_separation["Gim-Alfriend"]
    slope = float(np.log10(gim[-1] / gim[-3]))
    hill, tschauner = by_eccentricity["Hill"], by_eccentricity["Tschauner-Hempel"]
    eccentric, exact = by_eccentricity["Gim-Alfriend"], by_eccentricity["nonlinear with J2"]
    at_tenth = int(np.flatnonzero(eccentricities == 0.1)[0])
    nodal = by_separation["Hill"][2] / by_separation["Schweighart-Sedwick, nodal"][2]
    required = "(required)"
    limits = [
        Figure("nonlinear with J2, 1 km, every e: greatest", required, 1e3 * exact.max(), "mm", 0.0, 0.1),
        Figure(
            "nonlinear with J2, 100 km",
            required,
            1e3 * by_separation["nonlinear with J2"][-1],
            "mm",
            0.0,
            0.1,
        ),
        Figure("Gim-Alfriend, 10 m", required, 1e3 * gim[0], "mm", 0.0, 10.0),
        Figure("order of Gim-Alfriend's error, 10 to 100 km", "2 (linear model)", slope, "", 1.9, 2.1),
        Figure(
            "Tschauner-Hempel's error over Gim-Alfriend's, 1 km, e = 0.1",
            required,
            tschauner[at_tenth] / eccentric[at_tenth],
            "",
            3.0,
            1e3,
        ),
        Figure(
            "Hill's over Tschauner-Hempel's, 1 km, e = 0.1",
            required,
            hill[at_tenth] / tschauner[at_tenth],
            "",
            10.0,
            1e4,
        ),
        Figure("Hill's over nodal Schweighart-Sedwick's, 100 m", required, nodal, "", 1.0, 1e3),
    ]
    lines = ["## All models, against separation and eccentricity", ""]
    lines += [
        f"Largest position error over {ORBITS} orbits with J2 at an inclination of 50 deg, m. Every model",
        "starts from the same relative state, which does not drift in the truth: half the separation",
        "outwards, all of it ahead, half across. By separation: a chief that J2 keeps circular on average,",
        "at 7000 km, started with (29). By eccentricity: perigee at 7000 km; the circular models take the",
        "osculating semi-major axis. All are compared in Cartesian Hill coordinates. The start that does",
        "not drift in the truth drifts in every linear model at second order in the separation, and in the",
        "models without J2 at first order too: that is most of their error. The averaged models gain little",
        "over Hill's here: Roberts' conclusion, that they are good with initial conditions of their own, is",
        "Fig. 7 above. Truth: the difference of two integrated inertial orbits.",
        "",
        "| model | " + " | ".join(f"{s:g} m" for s in separations[::2]) + " |",
        "|---|" + "---|" * len(separations[::2]),
    ]
    lines += [f"| {m} | " + " | ".join(f"{e:.2g}" for e in v[::2]) + " |" for m, v in by_separation.items()]
    lines += ["", "The same at 1 km, by eccentricity:", ""]
    lines += ["| model | " + " | ".join(f"e = {e:g}" for e in eccentricities) + " |"]
    lines += ["|---|" + "---|" * len(eccentricities)]
    lines += [f"| {m} | " + " | ".join(f"{e:.2g}" for e in v) + " |" for m, v in by_eccentricity.items()]
    lines += ["", TABLE, *(figure.row for figure in limits), ""]
    lines += ["![Error of every model](relative_motion_models.png)", ""]

    plot, (left, right) = plt.subplots(1, 2, figsize=(13, 5.5), sharey=True)
    for name, values in by_separation.items():
        left.loglog(separations, values, marker=".", label=name)
        right.loglog(eccentricities, by_eccentricity[name], marker=".", label=name)
    left.set(xlabel="separation, m (circular chief)", ylabel=f"largest position error over {ORBITS} orbits, m")
    right.set(xlabel="eccentricity (separation 1 km)")
    for chart in (left, right):
        chart.grid(alpha=0.3, which="both")
    left.legend(fontsize=8)
    plot.tight_layout()
    plot.savefig(directory / "relative_motion_models.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    return "\n".join(lines), limits


def main(directory: Path) -> int:
    """Write the section and its plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    sections, figures = [], []
    for part in (roberts, all_models):
        text, limits = part(directory)
        sections.append(text)
        figures += limits
    heading = "# Relative-motion models\n\nWritten by `verification/relative_motion.py`.\n\n"
    (directory / "relative_motion.md").write_text(heading + "\n".join(sections))
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
