"""Recorded runs side by side: their figures, topics and curves."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.matplotlib_renderer import draw
from formation_gnc.analysis.metrics import deputies_of, figures, trajectory
from formation_gnc.analysis.plot import COLOURS, TIME, Axis, Curve, Plot, Style
from formation_gnc.analysis.thinning import POINTS
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


def gnc_topics(*bags: Bag) -> list[str]:
    """Topics on which two equal runs have the same bits: the clock and the project's own but timing."""
    types = {topic: each.type_name for bag in bags for topic, each in bag.topics.items()}
    return sorted(
        topic
        for topic, name in types.items()
        if topic == topics.CLOCK.name or (name.startswith("formation_gnc_msgs/") and name != TIMING_TYPE)
    )


def commanded_delta_v(bag: Bag, deputy: str) -> tuple[Vector, Vector]:
    """Delta-v that the controller commanded, whether or not it was applied.

    Returns:
        (N,) time, s, and (N,) delta-v up to the end of that tick, all axes added, m/s.
    """
    topic = topics.THRUST.of(deputy)
    if topic not in bag.topics or bag.topics[topic].count == 0:
        return np.zeros(0), np.zeros(0)
    thrust, truth = bag.arrays(topic, ("force",)), bag.arrays(topics.TRUTH.name, ("deputies",))
    prefix = f"deputies.{deputies_of(bag).index(deputy)}."
    mass = np.interp(thrust["time"], truth["time"], truth[f"{prefix}mass"])
    tick = bag.tick_ns * 1e-9
    return thrust["time"], np.cumsum(np.abs(thrust["force"]).sum(axis=1) / mass) * tick


def run_figures(bag: Bag) -> dict[str, dict[str, float]]:
    """Figures of a run by name, for the run as a whole ("") and for each deputy.

    Raises:
        BagError: no truth, or a deputy without estimates or targets.
    """
    result = figures(bag)
    table: dict[str, dict[str, float]] = {"": {"ticks": result.ticks, "misses": result.misses}}
    for name, deputy in result.deputies.items():
        values = asdict(deputy)
        for axis, value in zip("xyz", values.pop("delta_v_axes_m_s"), strict=True):
            values[f"delta_v_{axis}_m_s"] = value
        _, delta_v = commanded_delta_v(bag, name)
        values["commanded_delta_v_m_s"] = float(delta_v[-1]) if len(delta_v) else 0.0
        table[name] = values
    return table


def draw_comparison(bags: Sequence[Bag], labels: Sequence[str], path: Path) -> None:
    """Draw errors, applied and commanded delta-v over time: a row per deputy, a curve per bag."""
    names = list(dict.fromkeys(name for bag in bags for name in deputies_of(bag)))
    figure = Figure(figsize=(19.0, 4.2 * len(names) + 0.4), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(names), len(AXES))
    for row, name in enumerate(names):
        curves: list[list[Curve]] = [[] for _ in AXES]
        for bag, label, colour in zip(bags, labels, cycle(COLOURS), strict=False):
            if name in deputies_of(bag):
                for of_axis, (time, values) in zip(curves, _series(bag, name), strict=True):
                    step = max(1, len(time) // POINTS)
                    of_axis.append(Curve(label, time[::step] / 3600.0, values[::step], Style(colour, width=1.1)))
        for column, (axis, of_axis) in enumerate(zip(AXES, curves, strict=True)):
            draw(figure, grid[row, column], Plot(name, TIME, axis, of_axis))
    figure.savefig(path)


def _series(bag: Bag, deputy: str) -> Iterator[tuple[Vector, Vector]]:
    """Time (s) and values of each of AXES."""
    path = trajectory(bag, deputy)
    yield path.time, np.linalg.norm(path.error, axis=1)
    yield path.time, np.linalg.norm(path.estimation_error[:, :3], axis=1)
    yield path.applied_time, 1e3 * np.cumsum(np.abs(path.applied).sum(axis=1)) * path.tick
    time, delta_v = commanded_delta_v(bag, deputy)
    yield time, 1e3 * delta_v
