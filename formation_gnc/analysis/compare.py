"""Recorded runs side by side: their figures, topics and curves."""

from collections.abc import Iterator, Sequence
from itertools import cycle
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.matplotlib_renderer import draw
from formation_gnc.analysis.plot import COLOURS, TIME, Axis, Curve, Plot, Style
from formation_gnc.analysis.thinning import POINTS
from formation_gnc.analysis.trajectory import Trajectory, trajectories
from formation_gnc.flight import topics
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Vector

TIMING_TYPE = "formation_gnc_msgs/msg/Timing"
"""Message type of wall time, in which two equal runs differ."""

AXES = (
    Axis("control error", "m", log=True),
    Axis("estimation error", "m", log=True),
    Axis("delta-v applied", "mm/s"),
    Axis("delta-v commanded", "mm/s"),
)
"""Quantities that are compared over time."""

LINES: tuple[Literal["solid", "dashed", "dotted"], ...] = ("solid", "dashed", "dotted")
"""Lines of runs that follow one another, so that equal curves are seen below one another."""


def gnc_topics(*bags: Bag) -> list[str]:
    """Topics on which two equal runs have the same bits: the clock and the project's own but timing."""
    types = {topic: each.type_name for bag in bags for topic, each in bag.topics.items()}
    return sorted(
        topic
        for topic, name in types.items()
        if topic == topics.CLOCK.name or (name.startswith("formation_gnc_msgs/") and name != TIMING_TYPE)
    )


def run_figures(bag: Bag) -> dict[str, dict[str, float | str | None]]:
    """Figures of a run by name, for the run as a whole ("") and for each deputy.

    Raises:
        BagError: no truth, or a deputy without estimates or targets.
    """
    result = figures(bag)
    table: dict[str, dict[str, float | str | None]] = {"": {"ticks": result.ticks, "misses": result.misses}}
    return table | {name: deputy.shown() for name, deputy in result.deputies.items()}


@np.errstate(all="ignore")  # what a bag holds may be as large as a float
def draw_comparison(bags: Sequence[Bag], labels: Sequence[str], path: Path) -> None:
    """Draw errors, applied and commanded delta-v over time: a row per deputy, a curve per bag."""
    runs = [trajectories(bag) for bag in bags]
    names = list(dict.fromkeys(name for run in runs for name in run))
    figure = Figure(figsize=(13.0, 8.0 * len(names) + 0.4), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(AXES) // 2 * len(names), 2)
    for row, name in enumerate(names):
        curves: list[list[Curve]] = [[] for _ in AXES]
        looks = (Style(colour, line) for colour, line in zip(cycle(COLOURS), cycle(LINES)))
        for run, label, look in zip(runs, labels, looks, strict=False):
            if name in run:
                for of_axis, (time, values) in zip(curves, _series(run[name]), strict=True):
                    step = max(1, len(time) // POINTS)
                    of_axis.append(Curve(label, time[::step] / 3600.0, values[::step], look))
        for column, (axis, of_axis) in enumerate(zip(AXES, curves, strict=True)):
            place = grid[len(AXES) // 2 * row + column // 2, column % 2]
            draw(figure, place, Plot(f"{name}: {axis.label}", TIME, axis, of_axis))
    figure.savefig(path)


def _series(path: Trajectory) -> Iterator[tuple[Vector, Vector]]:
    """Time (s) and values of each of AXES."""
    yield path.time, np.linalg.norm(path.error, axis=1)
    yield path.time, np.linalg.norm(path.estimation_error[:, :3], axis=1)
    yield path.applied_time, 1e3 * np.cumsum(np.abs(path.applied).sum(axis=1)) * path.tick
    yield path.commanded_time, 1e3 * path.commanded_delta_v
