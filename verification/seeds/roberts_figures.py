"""Roberts' Figs. 3 to 6, 8, 9 and 11: motion about the reference and of two satellites, by models and truth."""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import J2GradientModel, circular_gradient
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.relative_motion import advance, curvilinear, leader_and_follower, march, on_reference
from verification.seeds.accepted import Ours

PAGE = "roberts"

Array = NDArray[np.float64]

ORBITS = 5
AXES = ("radial", "along-track", "cross-track")
LEAN, SUN = (CircularReference(7e6, math.radians(degrees)) for degrees in (35.0, 97.87))


@dataclass(frozen=True)
class Terms:
    """What an equation of motion of one perturbed satellite about the circular reference has of J2."""

    gradient: str = "none"
    """none, averaged (22) or varying (12)."""
    corrected: bool = False
    """Whether the reference has the rate n c (15), and the averaged J2 acceleration is taken off."""
    nodal: bool = False
    """Whether the latitude is k t (31), and the cross-track component is taken off: (16)."""

    def march(self, reference: CircularReference, start: Array, times: Array) -> Array:
        """(N, 3) motion from a relative state (6,) on the node."""
        n, turn = reference.mean_motion, reference.rate if self.corrected else reference.mean_motion
        speed = reference.nodal_rate if self.nodal else turn
        hill = HillModel(n).dynamics(0.0)
        hill[3, 4], hill[4, 3] = 2.0 * turn, -2.0 * turn
        hill[3, 0], hill[4, 1] = 2.0 * n**2 + turn**2, turn**2 - n**2
        averaged = SchweighartSedwickModel(reference).reference.averaged
        size, sine = 1.5 * reference.oblateness * n**2 * reference.radius, math.sin(reference.inclination)
        cosine = math.cos(reference.inclination)

        def rate(time: float, state: Array) -> Array:
            u = speed * time
            result = np.asarray(hill @ state)
            if self.gradient == "averaged":
                result[3:] += n**2 * averaged * np.array([4.0, -1.0, -3.0]) * state[:3]
            elif self.gradient == "varying":
                result[3:] += n**2 * circular_gradient(reference, u) @ state[:3]
            result[3] -= size * (1.0 - 3.0 * (sine * math.sin(u)) ** 2)
            result[4] -= size * sine**2 * math.sin(2.0 * u)
            if not self.nodal:
                result[5] -= size * 2.0 * sine * cosine * math.sin(u)
            if self.corrected:
                result[3] += n**2 * reference.radius * averaged
            return result

        solution = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-10, atol=1e-8)
        return np.asarray(solution.y[:3].T)


def kick(reference: CircularReference, nodal: bool) -> Array:
    """(6,) rest but for the along-track rate of (27), or of (29)."""
    rate = reference.nodal_rate if nodal else reference.rate
    speed = 0.75 * reference.oblateness * reference.mean_motion**2 * reference.radius / rate
    return np.array([0.0, 0.0, 0.0, 0.0, speed * math.sin(reference.inclination) ** 2, 0.0])


def truth(reference: CircularReference, start: Array, times: Array) -> Array:
    """(N, 3) one satellite under J2 in the curvilinear axes of the reference, whose plane stays and rate is n c."""
    moved, found = on_reference(reference, start), []
    for index, time in enumerate(times):
        if index:
            moved = advance(moved, float(time - times[index - 1]))
        turned = np.array([0.0, reference.radius * reference.rate * time, 0.0, 0.0, 0.0, 0.0])
        found.append(curvilinear(on_reference(reference, turned), moved))
    return np.array(found)


def drift(motion: Array) -> float:
    """From the start to the end of five whole orbits, m, so that periodic motion has come round."""
    return float(motion[-1] - motion[0])


def instants(reference: CircularReference) -> Array:
    """Five orbits."""
    return np.linspace(0.0, ORBITS * math.tau / reference.mean_motion, 301)


covers(
    "Roberts Fig. 3",
    "relative/schweighart_sedwick.py",
    figures=(
        "Fig. 3: radial drift with the gradient",
        "Fig. 3: radial drift with the rate corrected, over that with the gradient alone",
        "Fig. 3: along-track drift with the rate corrected",
        "Fig. 3: cross-track, what gradient and correction change in 5 orbits",
    ),
    differs="all that is said of the plane is so; cross-track changes by 2.7 km, not 1 km",
)
covers(
    "Roberts Fig. 4",
    "relative/schweighart_sedwick.py",
    figures=("Fig. 4: along-track drift over its amplitude",),
    differs="what the text says of it comes out; the plot is lost in the text; ours is roberts_figures.png",
)
covers(
    "Roberts (35), (36)",
    "relative/schweighart_sedwick.py",
    figures=(
        "Fig. 5: radial error with the gradient over that without",
        "Fig. 5: along-track, the same",
        "Fig. 5: cross-track, the same",
    ),
)
covers(
    "Roberts Fig. 5",
    "relative/schweighart_sedwick.py",
    figures=(
        "Fig. 5: radial error with the gradient over that without",
        "Fig. 5: along-track, the same",
        "Fig. 5: cross-track, the same",
    ),
    differs="what the text says of it comes out; the plot is lost in the text; ours is roberts_figures.png",
)
covers("Roberts Fig. 6", figures=("Fig. 6: cross-track motion of the truth",))
covers(
    "Roberts Fig. 8",
    "relative/j2_gradient.py",
    figures=("Fig. 8: along-track drift at 35 deg over that at 97.87 deg",),
    differs="what the text says of it comes out; the plot is lost in the text; ours is roberts_figures.png",
)
covers(
    "Roberts Fig. 9",
    "relative/j2_gradient.py",
    figures=("Fig. 9: along-track drift over that of Fig. 8a",),
    differs="what the text says of it comes out; the plot is lost in the text; ours is roberts_figures.png",
)
covers(
    "Roberts Fig. 11",
    "relative/j2_gradient.py",
    figures=("Fig. 11: correlation of the radial motion, model and truth", "Fig. 11: cross-track of the truth"),
    differs="what the text says of it comes out; the plot is lost in the text; ours is roberts_figures.png",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """All figures of the model verification that show motion rather than its error."""
    ours, rest = Ours(), np.zeros(6)
    plot, panels = plt.subplots(8, 3, figsize=(16, 26))
    figures: list[Figure] = []
    lines = [
        "## Figs. 3 to 6, 8, 9 and 11",
        "",
        "Motion over five orbits, r = 7000 km: of one satellite under J2 about the circular reference, from the",
        "node, and",
        "of two satellites. Drift: from the start to the end of five whole orbits, m.",
        "",
        "| figure | equations, start | drift: radial | along-track | largest cross-track, m |",
        "|---|---|---|---|---|",
    ]

    def show(row: int, name: str, reference: CircularReference, motions: dict[str, Array]) -> dict[str, list[float]]:
        times, kept = instants(reference), dict[str, list[float]]()
        for label, motion in motions.items():
            kept[label] = [drift(motion[:, 0]), drift(motion[:, 1]), float(np.abs(motion[:, 2]).max())]
            words = [
                ours(f"{name}, {label}: {what}", value, ".4g", "m", max(1e-3 * abs(value), 1e-3))
                for what, value in zip(("radial drift", "along-track drift", "cross-track"), kept[label], strict=True)
            ]
            lines.append(f"| {name} | {label} | " + " | ".join(words) + " |")
            for panel, along in zip(panels[row], motion.T, strict=True):
                panel.plot(times * reference.mean_motion / math.tau, along, label=label)
        for panel, axis in zip(panels[row], AXES, strict=True):
            panel.set(title=f"{name}: {axis}", xlabel="orbits", ylabel="m")
        panels[row, 0].legend(fontsize=7)
        return kept

    times = instants(LEAN)
    three = {
        "J2 as a force": Terms().march(LEAN, rest, times),
        "and its averaged gradient": Terms("averaged").march(LEAN, rest, times),
        "and the rate corrected": Terms("averaged", corrected=True).march(LEAN, rest, times),
    }
    first = show(0, "Fig. 3", LEAN, three)
    _, sloped, fixed = first.values()
    crossed = float(np.abs(three["and the rate corrected"][:, 2] - three["J2 as a force"][:, 2]).max())
    four = Terms("averaged", corrected=True).march(LEAN, kick(LEAN, False), times)
    bounded = show(1, "Fig. 4", LEAN, {"(35), start of (27)": four})["(35), start of (27)"]
    figures += [
        Figure(
            "Fig. 3: radial drift with the gradient",
            "significant",
            abs(sloped[0]) / 1e3,
            "km",
            1.0,
            1e3,
        ),
        Figure(
            "Fig. 3: radial drift with the rate corrected, over that with the gradient alone",
            "eliminated (0)",
            abs(fixed[0] / sloped[0]),
            "",
            0.0,
            0.01,
        ),
        Figure("Fig. 3: along-track drift with the rate corrected", "remains", abs(fixed[1]) / 1e3, "km", 1.0, 1e3),
        Figure(
            "Fig. 3: cross-track, what gradient and correction change in 5 orbits",
            "approximately 1 km",
            crossed / 1e3,
            "km",
            2.5,
            2.9,
        ),
        Figure(
            "Fig. 4: along-track drift over its amplitude",
            "bounded (0)",
            abs(bounded[1]) / float(np.ptp(four[:, 1])),
            "",
            0.0,
            0.2,
        ),
    ]
    times = instants(SUN)
    seen = truth(SUN, kick(SUN, False), times)
    models = {name: Terms(name, corrected=True).march(SUN, kick(SUN, False), times) for name in ("none", "averaged")}
    errors = {f"gradient: {name}": motion - seen for name, motion in models.items()}
    show(2, "Fig. 5, error", SUN, errors)
    without, within = (np.abs(each).max(axis=0) for each in errors.values())
    figures += [
        Figure(
            "Fig. 5: radial error with the gradient over that without",
            "significantly reduced (below 1)",
            within[0] / without[0],
            "",
            0.0,
            1.0,
        ),
        Figure(
            "Fig. 5: along-track, the same", "significantly reduced (below 1)", within[1] / without[1], "", 0.0, 1.0
        ),
        Figure("Fig. 5: cross-track, the same", "worsened (above 1)", within[2] / without[2], "", 1.0, math.inf),
    ]
    beside = np.array([0.0, 100.0, 0.0, 0.0, 0.0, 0.0])
    pair = leader_and_follower(SUN, SchweighartSedwickModel(SUN).centred(0.0, beside), times)
    show(3, "Fig. 6, truth", SUN, {"two satellites": pair})
    figures.append(
        Figure(
            "Fig. 6: cross-track motion of the truth",
            "just 2 cm",
            100.0 * float(np.abs(pair[:, 2]).max()),
            "cm",
            1.5,
            2.5,
        )
    )
    eight = {}
    for row, name, reference in ((4, "Fig. 8a", SUN), (5, "Fig. 8b", LEAN)):
        motion = Terms("varying", corrected=True).march(reference, kick(reference, False), instants(reference))
        eight[name] = show(row, name, reference, {"(37), start of (27)": motion})["(37), start of (27)"]
    nine = Terms("varying", corrected=True, nodal=True).march(SUN, kick(SUN, True), times)
    last = show(6, "Fig. 9", SUN, {"(16), start of (29)": nine})["(16), start of (29)"]
    figures += [
        Figure(
            "Fig. 8: along-track drift at 35 deg over that at 97.87 deg",
            "much more significant (above 1)",
            abs(eight["Fig. 8b"][1] / eight["Fig. 8a"][1]),
            "",
            1.0,
            math.inf,
        ),
        Figure(
            "Fig. 9: along-track drift over that of Fig. 8a",
            "reduced, and turned (-1 to 0)",
            last[1] / eight["Fig. 8a"][1],
            "",
            -1.0,
            0.0,
        ),
    ]
    mustang = CircularReference(6978.1e3, math.radians(85.0))
    times = instants(mustang)
    pair = leader_and_follower(mustang, beside, times)
    model = march(J2GradientModel(mustang), beside, times)[:, :3]
    show(7, "Fig. 11", mustang, {"truth": pair, "time-varying": model})
    shape = float(np.corrcoef(pair[:, 0], model[:, 0])[0, 1])
    figures += [
        Figure("Fig. 11: correlation of the radial motion, model and truth", "captures the shape", shape, "", 0.9, 1.0),
        Figure(
            "Fig. 11: cross-track of the truth",
            "approaches zero",
            100.0 * float(np.abs(pair[:, 2]).max()),
            "cm",
            0.0,
            1.0,
        ),
    ]
    save(plot, directory / "roberts_figures.png")
    lines += ["", "![Figs. 3 to 6, 8, 9 and 11](roberts_figures.png)", ""]
    return "\n".join(lines), [*figures, *ours.cells]
