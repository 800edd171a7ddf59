"""Owis beyond his two transfers: controllability along the path, soft end, perturbed starts, a constellation."""

from collections.abc import Callable
from math import pi
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.fixed_endpoint_lq import Cost, approximating_sequence
from formation_gnc.orbit.constants import MU
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours, joined
from verification.seeds.owis import (
    CIRCULAR,
    FILLS,
    MOST_ITERATIONS,
    START,
    STEPS,
    TOLERANCE,
    Transfer,
    asre,
    flown,
    radial,
    rate_of,
    system,
)
from verification.seeds.owis import corrected as by_angle

PAGE = "owis"

Array = NDArray[np.float64]

FIRST = Transfer(1.5 * pi, 4.469, CIRCULAR)
GNSS = 26_560e3
"""m; of GPS."""
LATE = 4
"""Steps by which a start is late."""


covers(
    "Owis 4, controllability",
    figures=("controllability: least singular value over the largest, along the path",),
    differs="rank 4 all along both factorisations; the text's matrix lacks A²B, and rows that do not vanish "
    "are no proof of rank",
)
covers(
    "Owis soft terminal weight",
    "control/fixed_endpoint_lq.py",
    figures=("soft end: miss at Q_f = 1e6 over that at 1", "soft end: J at Q_f = 1e6 over that of the fixed end"),
    differs="the text gives no Q_f and no figure",
)
covers(
    "Owis perturbed start",
    "control/fixed_endpoint_lq.py",
    figures=(
        "perturbed start: miss, old thrust held",
        "perturbed start: miss, gains of the last iteration",
        "perturbed start: miss, planned anew",
        "perturbed time: miss, gains of the last iteration",
        "perturbed time: miss, planned anew",
    ),
    differs="evaluating the law again does not end where it should: the gains are those along the old path; "
    "a new sequence does",
)
covers(
    "Owis GNSS constellation; Fig. 1",
    "control/fixed_endpoint_lq.py",
    figures=("constellation: miss of six satellites", "constellation: largest angle between neighbours off 60 deg"),
    differs="six satellites of one plane, r = 26,560 km, raised by a fifth, Q = 0; the text gives no "
    "constellation, and its drawing no "
    "numbers",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """All four."""
    return joined(directory, controllability, soft, perturbed, constellation)


def controllability(_: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Singular values of [B AB A^2B A^3B] along the first transfer with Q = 0."""
    path, _cost = flown(FIRST, asre(FIRST, by_angle, 0.0).trajectory.inputs, 0.0)
    lines = [
        "## Owis: controllability along the path",
        "",
        "[B AB A²B A³B] on the first transfer, Q = 0, in canonical units.",
        "",
        "| gravity in | rank | least singular value over the largest |",
        "|---|---|---|",
    ]
    least = []
    for column, fill in list(FILLS.items())[1:]:
        a, b = system(fill)(path)
        powers = [b]
        for _power in range(3):
            powers.append(a @ powers[-1])
        values = np.linalg.svd(np.concatenate(powers, axis=2), compute_uv=False)
        least.append(float((values[:, -1] / values[:, 0]).min()))
        rank = int((values > 1e-9 * values[:, :1]).sum(axis=1).min())
        lines.append(
            f"| {column} | {ours(f'controllability, {column}: rank', rank, 'd', margin=0.0)} | "
            f"{ours(f'controllability, {column}: conditioning', least[-1], '.3g')} |"
        )
    lines.append("")
    return "\n".join(lines), [
        Figure(
            "controllability: least singular value over the largest, along the path",
            "above 0 (rank 4)",
            min(least),
            "",
            1e-3,
            1.0,
        )
    ]


def soft(_: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """The end weighed by Q_f instead of met."""
    step, fixed = FIRST.duration / STEPS, asre(FIRST, radial, 0.0)
    _path, best = flown(FIRST, fixed.trajectory.inputs, 0.0)
    lines = [
        "## Owis: a soft end",
        "",
        "First transfer, Q = 0, R = I, gravity in the column of r: the end weighed by Q_f I in place of met.",
        "",
        "| Q_f | iterations | miss | J of the thrust |",
        "|---|---|---|---|",
    ]
    misses, costs = [], []
    for weight in (1.0, 1e2, 1e4, 1e6):
        cost = Cost(np.zeros((4, 4)), step * np.eye(2), np.eye(4) / weight)
        found = approximating_sequence(
            system(radial), FIRST.line, FIRST.goal, FIRST.duration, cost, np.ones(4), TOLERANCE, MOST_ITERATIONS
        )
        path, spent = flown(FIRST, found.trajectory.inputs, 0.0)
        misses.append(float(np.abs(path[-1] - FIRST.goal).max()))
        costs.append(spent)
        words = [
            ours(f"soft end, {weight:g}: iterations", len(found.changes), "d", margin=0.0),
            ours(f"soft end, {weight:g}: miss", misses[-1], ".3g", margin=max(1e-3 * misses[-1], TOLERANCE)),
            ours(f"soft end, {weight:g}: J", spent, ".5g"),
        ]
        lines.append(f"| {weight:g} | " + " | ".join(words) + " |")
    lines += [f"| fixed | | | {best:.5g} |", ""]
    return "\n".join(lines), [
        Figure("soft end: miss at Q_f = 1e6 over that at 1", "towards 0", misses[-1] / misses[0], "", 0.0, 0.01),
        Figure("soft end: J at Q_f = 1e6 over that of the fixed end", "towards 1", costs[-1] / best, "", 0.99, 1.01),
    ]


def perturbed(_: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """A start off by one per cent in every state, or late by that of the time; with the old path, or a new sequence."""
    found = asre(FIRST, radial, 0.0)
    inputs, path = found.trajectory.inputs, found.trajectory.states
    step = FIRST.duration / STEPS
    gains = feedback(path, step)

    def fly(start: Array, first: int, thrust_at: Callable[[int, Array], Array]) -> float:
        state = start
        for index in range(first, STEPS):
            thrust = thrust_at(index, state)
            one = rate_of(state, thrust)
            two = rate_of(state + 0.5 * step * one, thrust)
            three = rate_of(state + 0.5 * step * two, thrust)
            four = rate_of(state + step * three, thrust)
            state = state + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        return float(np.abs(state - FIRST.goal).max())

    lines = [
        "## Owis: a perturbed start",
        "",
        "First transfer, Q = 0, gravity in the column of r. *Off*: every state by 0.01 at the start; *late*: the start",
        f"as it is, {LATE / STEPS:.0%} of the time later, with the end where and when it was. *Gains*: those of",
        "the linear problem of the last iteration for a fixed end, on the difference from its path; none over the",
        "last 2 %.",
        "",
        "| flown | miss at the end, off | late |",
        "|---|---|---|",
    ]
    misses: dict[str, list[float]] = {"old thrust held": [], "gains of the last iteration": [], "planned anew": []}
    for start, first in ((START + 0.01, 0), (START, LATE)):
        line = start + np.linspace(0.0, 1.0, STEPS + 1 - first)[:, None] * (FIRST.goal - start)
        cost = Cost(np.zeros((4, 4)), step * np.eye(2), np.zeros((4, 4)))
        duration = (STEPS - first) * step
        anew = approximating_sequence(
            system(radial), line, FIRST.goal, duration, cost, np.ones(4), TOLERANCE, MOST_ITERATIONS
        ).trajectory.inputs
        ways: tuple[Callable[[int, Array], Array], ...] = (
            lambda index, _: inputs[index],
            lambda index, state: inputs[index] - gains[index] @ (state - path[index]),
            lambda index, _, anew=anew, first=first: anew[index - first],  # type: ignore[misc]
        )
        for name, way in zip(misses, ways, strict=True):
            misses[name].append(fly(start, first, way))
    for name, each in misses.items():
        words = [
            ours(f"perturbed start{when}, {name}", miss, ".3g", margin=max(1e-3 * miss, 1e-7))
            for when, miss in zip(("", " late"), each, strict=True)
        ]
        lines.append(f"| {name} | {' | '.join(words)} |")
    lines += [
        "",
        "The linear law answers a small error, and to first order only; a new sequence meets the end again.",
        "",
    ]
    figures = []
    for place, when in enumerate(("perturbed start", "perturbed time")):
        held, by_gains, anew_miss = (each[place] for each in misses.values())
        figures += [
            Figure(f"{when}: miss, old thrust held", "", held, "", 0.0, 1.0),
            Figure(f"{when}: miss, gains of the last iteration", "0", by_gains, "", 0.0, held),
            Figure(f"{when}: miss, planned anew", "0", anew_miss, "", 0.0, 1e-5),
        ]
    return "\n".join(lines), figures


def feedback(path: Array, step: float) -> Array:
    """(N, 2, 4) gains of the minimum-effort return to a fixed end of the linear problem along a path."""
    a, b = system(radial)(path[:-1])
    size, gains = len(a), np.zeros((len(a), 2, 4))
    transition, gramian = np.eye(4), np.zeros((4, 4))
    for index in range(size - 1, -1, -1):
        phi = np.eye(4) + step * a[index] + 0.5 * step**2 * a[index] @ a[index]
        gamma = step * (np.eye(4) + 0.5 * step * a[index]) @ b[index]
        own = transition @ gamma
        gramian = gramian + own @ own.T
        transition = transition @ phi
        if index < 0.98 * size:
            gains[index] = own.T @ np.linalg.solve(gramian, transition)
    return gains


def constellation(directory: Path, ours: Ours) -> tuple[str, list[Figure]]:
    """Six GNSS satellites of one plane, raised together by a fifth."""
    unit, plot = np.sqrt(GNSS**3 / MU), plt.figure(figsize=(6, 6))
    panel = plot.add_subplot()
    found = asre(FIRST, radial, 0.0)
    path, cost = flown(FIRST, found.trajectory.inputs, 0.0)
    ends, spent = [], 0.0
    for index in range(6):
        angle = path[:, 1] + index * pi / 3.0
        panel.plot(path[:, 0] * np.cos(angle), path[:, 0] * np.sin(angle))
        panel.plot(*(path[-1, 0] * np.array([[np.cos(angle[-1])], [np.sin(angle[-1])]])), "ko", ms=4)
        ends.append(angle[-1])
        spent += float(np.linalg.norm(found.trajectory.inputs, axis=1).sum()) * FIRST.duration / STEPS
    turn = np.linspace(0.0, 2.0 * pi, 200)
    for radius in (1.0, 1.2):
        panel.plot(radius * np.cos(turn), radius * np.sin(turn), "k", lw=0.5)
    panel.set(aspect="equal", xlabel=f"x, {GNSS / 1e3:g} km", ylabel="y", title="Fig. 1: a constellation raised")
    save(plot, directory / "owis_constellation.png")
    miss = float(np.abs(path[-1] - FIRST.goal).max())
    apart = float(np.abs(np.diff(np.degrees(ends)) - 60.0).max())
    hours = FIRST.duration * unit / 3600.0
    lines = [
        "## Owis: a constellation",
        "",
        f"Six satellites of one plane at {GNSS / 1e3:g} km, raised to {1.2 * GNSS / 1e3:g} km in {hours:.2f} h: the",
        "equations do not know the angle with gravity in the column of r, so that all fly one plan, turned.",
        f"Delta-v {ours('constellation: delta-v', spent / 6.0 * float(np.sqrt(MU / GNSS)), '.4g', 'm/s')} m/s each; J",
        f"{ours('constellation: J', cost, '.4g')} each, in canonical units.",
        "",
        "![A constellation raised](owis_constellation.png)",
        "",
    ]
    return "\n".join(lines), [
        Figure("constellation: miss of six satellites", "0", miss, "", 0.0, 1e-6),
        Figure("constellation: largest angle between neighbours off 60 deg", "0", apart, "deg", 0.0, 1e-6),
    ]
