"""Runs side by side: their figures, and what differs."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.metrics import deputies_of, figures, trajectory
from formation_gnc.analysis.run_history import POINTS
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Vector

OF_WALL_TIME = "formation_gnc_msgs/msg/Timing"


def gnc_topics(*bags: Bag) -> list[str]:
    """Topics of the bags that the same run fills with the same bits: the project's own, but for wall time."""
    types = {topic: each.type_name for bag in bags for topic, each in bag.topics.items()}
    return sorted(
        topic
        for topic, kind in types.items()
        if topic == "/clock" or (kind.startswith("formation_gnc_msgs/") and kind != OF_WALL_TIME)
    )


def commanded(bag: Bag, deputy: str) -> tuple[Vector, Vector]:
    """What the controller asked for, whether or not it was flown.

    Returns:
        (N,) time, s, and (N,) delta-v commanded up to the end of that tick, all axes added, m/s.
    """
    topic = f"/{deputy}/thrust"
    if topic not in bag.topics or bag.topics[topic].count == 0:
        return np.zeros(0), np.zeros(0)
    thrust, truth = bag.arrays(topic), bag.arrays("/truth")
    prefix = f"deputies.{deputies_of(bag).index(deputy)}."
    mass = np.interp(thrust["time"], truth["time"], truth[f"{prefix}mass"])
    tick = float(truth["time"][1] - truth["time"][0]) if len(truth["time"]) > 1 else 0.0
    return thrust["time"], np.cumsum(np.abs(thrust["force"]).sum(axis=1) / mass) * tick


def run_figures(bag: Bag) -> dict[str, dict[str, float]]:
    """Figures of a run by name, for the run as a whole ("") and for each deputy."""
    result = figures(bag)
    table: dict[str, dict[str, float]] = {"": {"ticks": result.ticks, "misses": result.misses}}
    for name, deputy in result.deputies.items():
        values = asdict(deputy)
        for axis, value in zip("xyz", values.pop("delta_v_axes_m_s"), strict=True):
            values[f"delta_v_{axis}_m_s"] = value
        _, spent = commanded(bag, name)
        values["commanded_delta_v_m_s"] = float(spent[-1]) if len(spent) else 0.0
        table[name] = values
    return table


def draw_comparison(bags: Sequence[Bag], labels: Sequence[str], path: Path) -> None:
    """Draw errors, flown and commanded delta-v over time: a row a deputy, a curve a bag."""
    names = list(dict.fromkeys(name for bag in bags for name in deputies_of(bag)))
    figure = Figure(figsize=(19.0, 4.2 * len(names) + 0.4), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    for row, name in zip(figure.subplots(len(names), 4, squeeze=False), names, strict=True):
        for bag, label in zip(bags, labels, strict=True):
            if name not in deputies_of(bag):
                continue
            flown = trajectory(bag, name)
            spent = np.cumsum(np.abs(flown.applied).sum(axis=1)) * flown.tick
            curves = (
                (flown.time, np.linalg.norm(flown.error, axis=1)),
                (flown.time, np.linalg.norm(flown.estimation_error[:, :3], axis=1)),
                (flown.applied_time, 1e3 * spent),
                (commanded(bag, name)[0], 1e3 * commanded(bag, name)[1]),
            )
            for axes, (time, values) in zip(row, curves, strict=True):
                step = max(1, len(time) // POINTS)
                axes.plot(time[::step] / 3600.0, values[::step], lw=1.1, label=label)
        said = (
            "control error [m]",
            "estimation error [m]",
            "delta-v flown [mm/s]",
            "delta-v commanded [mm/s]",
        )
        for axes, text in zip(row, said, strict=True):
            axes.set(xlabel="time [h]", ylabel=text, title=name)
            axes.grid(alpha=0.3)
        for axes in row[:2]:
            axes.set_yscale("log")
        row[0].legend(loc="best", fontsize="small")
    figure.savefig(path)
