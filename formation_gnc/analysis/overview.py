"""A recorded run as pictures, for a README or a paper."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.run_history import AXES, DeputyHistory, RunHistory

COLOURS = ("tab:blue", "tab:orange", "tab:green")


def draw_overview(flown: RunHistory, path: Path, title: str) -> Path:
    """Draw four panels for every deputy: path, control error, estimation error with 3 sigma, thrust.

    Returns:
        The path of the PNG file.
    """
    deputies = flown.deputies.values()
    columns = 2 if len(deputies) == 1 else 4  # a fleet reads best with a row for each
    rows = 4 * len(deputies) // columns
    figure = Figure(figsize=(5.5 * columns, 4.4 * rows + 0.4), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    panels = figure.subplots(rows, columns, squeeze=False).reshape(len(deputies), 4)
    for row, deputy in zip(panels, deputies, strict=True):
        for axes, draw in zip(row, PANELS.values(), strict=True):
            draw(axes, deputy)
    figure.savefig(path)
    return path


def draw_panels(flown: RunHistory, directory: Path) -> list[Path]:
    """Draw each panel of the overview for itself, as `DEPUTY_PANEL.png`.

    Returns:
        The paths of the files.
    """
    paths = []
    for deputy in flown.deputies.values():
        for name, draw in PANELS.items():
            figure = Figure(figsize=(6.0, 4.5), layout="constrained", dpi=150)
            FigureCanvasAgg(figure)
            draw(figure.subplots(), deputy)
            paths.append(directory / f"{deputy.name}_{name}.png")
            figure.savefig(paths[-1])
    return paths


def _draw_path(axes: Any, flown: DeputyHistory) -> None:
    axes.plot(flown.truth[:, 1], flown.truth[:, 0], color="tab:blue", lw=1.2, label="true path")
    axes.plot(flown.target[:, 1], flown.target[:, 0], color="tab:red", lw=1.0, ls="--", label="target")
    axes.plot(*flown.truth[0, [1, 0]], "o", color="tab:blue", ms=5, label="start")
    if len(flown.target):
        axes.plot(*flown.target[-1, [1, 0]], "*", color="tab:red", ms=12, label="target at the end")
    axes.set(
        xlabel="along-track y [m]",
        ylabel="radial x [m]",
        title=f"{flown.name}: path in the chief's Hill frame",
    )
    axes.axis("equal")
    axes.invert_xaxis()
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_error(axes: Any, flown: DeputyHistory) -> None:
    hours, error = flown.control_time, flown.control[:, :3]
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(hours, np.abs(error[:, axis]), color=colour, lw=0.7, label=label)
    distance = np.linalg.norm(error, axis=1)
    axes.plot(hours, distance, color="black", lw=1.5, label="distance")
    axes.set(xlabel="time [h]", ylabel="|true position - target| [m]", title="control error")
    axes.set_yscale("log")
    axes.set_ylim(bottom=max(1e-3 * float(distance.max(initial=0.0)), 1e-9))
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_estimation(axes: Any, flown: DeputyHistory) -> None:
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(flown.error_time, flown.error[:, axis], color=colour, lw=1.0, label=label)
        for sign in (-3.0, 3.0):
            axes.plot(flown.sigma_time, sign * flown.sigma[:, axis], color=colour, lw=0.8, ls=":")
    axes.set(
        xlabel="time [h]",
        ylabel="estimate - truth [m]",
        title="estimation error, dotted: 3 sigma of the filter",
    )
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_thrust(axes: Any, flown: DeputyHistory) -> None:
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        axes.plot(flown.time, 1e6 * flown.acceleration[:, axis], color=colour, lw=0.9, label=label)
    axes.set(xlabel="time [h]", ylabel="acceleration by thrust [um/s^2]", title="thrust and delta-v (grey, right)")
    spent = axes.twinx()
    spent.plot(flown.time, 1e3 * flown.delta_v, color="grey", lw=1.5)
    spent.set(ylabel="delta-v [mm/s]")
    axes.legend(loc="best", fontsize="small")
    axes.grid(alpha=0.3)


PANELS = {
    "path": _draw_path,
    "control": _draw_error,
    "estimation": _draw_estimation,
    "thrust": _draw_thrust,
}
