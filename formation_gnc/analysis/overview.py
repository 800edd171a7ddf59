"""One picture of a whole run."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.metrics import Trajectory, deputies_of, trajectory
from formation_gnc.recording.reader import Bag

AXES = ("x radial", "y along-track", "z cross-track")
COLOURS = ("tab:blue", "tab:orange", "tab:green")
POINTS = 4000
"""Points that a curve is drawn with at most."""


def draw_overview(bag: Bag, path: Path, title: str) -> Path:
    """Draw four panels for every deputy: path, control error, estimation error with 3 sigma, thrust.

    Returns:
        The path of the PNG file.
    """
    names = deputies_of(bag)
    columns = 2 if len(names) == 1 else 4  # a fleet reads best with a row for each
    rows = 4 * len(names) // columns
    figure = Figure(figsize=(5.5 * columns, 4.4 * rows + 0.4), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    panels = figure.subplots(rows, columns, squeeze=False).reshape(len(names), 4)
    for row, name in zip(panels, names, strict=True):
        flown = trajectory(bag, name)
        _draw_path(row[0], flown, name)
        _draw_error(row[1], flown)
        _draw_estimation(row[2], flown)
        _draw_thrust(row[3], flown)
    figure.savefig(path)
    return path


def _thin(count: int) -> slice:
    return slice(None, None, max(1, count // POINTS))


def _draw_path(axes: Any, flown: Trajectory, name: str) -> None:
    thin = _thin(len(flown.time))
    axes.plot(flown.truth[thin, 1], flown.truth[thin, 0], color="tab:blue", lw=1.2, label="true path")
    axes.plot(flown.target[thin, 1], flown.target[thin, 0], color="tab:red", lw=1.0, ls="--", label="target")
    axes.plot(*flown.truth[0, [1, 0]], "o", color="tab:blue", ms=5, label="start")
    axes.plot(*flown.target[-1, [1, 0]], "*", color="tab:red", ms=12, label="target at the end")
    axes.set(
        xlabel="along-track y [m]", ylabel="radial x [m]", title=f"{name}: path in the chief's Hill frame"
    )
    axes.axis("equal")
    axes.invert_xaxis()
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_error(axes: Any, flown: Trajectory) -> None:
    thin, hours = _thin(len(flown.time)), flown.time / 3600.0
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(hours[thin], np.abs(flown.error[thin, axis]), color=colour, lw=0.7, label=label)
    distance = np.linalg.norm(flown.error[thin], axis=1)
    axes.plot(hours[thin], distance, color="black", lw=1.5, label="distance")
    axes.set(xlabel="time [h]", ylabel="|true position - target| [m]", title="control error")
    axes.set_yscale("log")
    axes.set_ylim(bottom=max(1e-3 * float(distance.max()), 1e-9))
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_estimation(axes: Any, flown: Trajectory) -> None:
    thin, hours = _thin(len(flown.time)), flown.time / 3600.0
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(hours[thin], flown.estimation_error[thin, axis], color=colour, lw=1.0, label=label)
        for sign in (-3.0, 3.0):
            axes.plot(hours[thin], sign * flown.sigma[thin, axis], color=colour, lw=0.8, ls=":")
    axes.set(
        xlabel="time [h]",
        ylabel="estimate - truth [m]",
        title="estimation error, dotted: 3 sigma of the filter",
    )
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_thrust(axes: Any, flown: Trajectory) -> None:
    thin, hours = _thin(len(flown.applied_time)), flown.applied_time / 3600.0
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(hours[thin], 1e6 * flown.applied[thin, axis], color=colour, lw=0.9, label=label)
    axes.set(
        xlabel="time [h]", ylabel="acceleration by thrust [um/s^2]", title="thrust and delta-v (grey, right)"
    )
    spent = axes.twinx()
    total = np.cumsum(np.abs(flown.applied).sum(axis=1)) * flown.tick
    spent.plot(hours[thin], 1e3 * total[thin], color="grey", lw=1.5)
    spent.set(ylabel="delta-v [mm/s]")
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)
