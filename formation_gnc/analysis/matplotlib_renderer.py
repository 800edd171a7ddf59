"""Plots drawn with Matplotlib, for pictures."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from formation_gnc.analysis.plot import Axis, Plot, Style
from formation_gnc.types import Vector

_LINES = {"solid": "-", "dashed": "--", "dotted": ":", "none": ""}
_MARKERS = {"none": "", "dot": "o", "star": "*", "diamond": "D"}

LEGEND_Y = -0.16
"""Top of a legend, in heights of the axes above their lower edge."""

LEGEND_COLUMNS = 4

LEGEND_WIDTH = 90
"""Characters that a line of a legend has room for, below axes of half a picture's width."""

LEGEND_LABEL = 60
"""Characters of a label in a legend; of a longer one, the end."""

LEGEND_KEY = 8
"""Width of a curve's sample beside its label, in characters."""

FURTHEST = 1e30
"""Largest coordinate that is drawn: the limits of an axis, and their squares, have to be numbers."""


def draw(figure: Figure, place: Any, plot: Plot) -> None:
    """Draw a plot at a place of a figure, a `SubplotSpec`."""
    axes: Any = figure.add_subplot(place, projection="3d" if plot.z else None)
    right = axes.twinx() if plot.right else None
    handles: dict[str, Any] = {}
    for curve in plot.curves:
        data = _drawable(curve.x, curve.y, *(() if curve.z is None else (curve.z,)))
        if data:
            (handle,) = (right if curve.right and right else axes).plot(*data, **_look(curve.style))
            handles.setdefault(curve.label, handle)
    for track in plot.tracks:
        data = _drawable(*track.position[-1:].T)
        if data:
            (handles[track.label],) = axes.plot(*data, **_look(track.style))
    axes.set(title=plot.title)
    _set_axis(axes, "x", plot.x)
    _set_axis(axes, "y", plot.y)
    if plot.z:
        _set_axis(axes, "z", plot.z)
    if plot.equal:
        axes.axis("equal")
    if right and plot.right:
        _set_axis(right, "y", plot.right)
    if handles:
        # Below the axes, where it covers no curve.
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, LEGEND_Y), "frameon": False, "fontsize": "small"}
        labels = [label if len(label) <= LEGEND_LABEL else f"…{label[1 - LEGEND_LABEL :]}" for label in handles]
        fitting = LEGEND_WIDTH // (LEGEND_KEY + max(map(len, labels)))
        axes.legend(handles.values(), labels, ncols=max(1, min(len(handles), LEGEND_COLUMNS, fitting)), **place)
    axes.grid(alpha=0.3)


def _drawable(*coordinates: Vector) -> tuple[Vector, ...]:
    """Coordinates with gaps where Matplotlib has no place for a point; none when it has for no point at all."""
    fits = np.all([np.abs(each) < FURTHEST for each in coordinates], axis=0)  # not a number: false
    return tuple(np.where(fits, each, np.nan) for each in coordinates) if fits.any() else ()


def _look(style: Style) -> dict[str, Any]:
    return {
        "color": style.colour,
        "linestyle": _LINES[style.line],
        "linewidth": style.width,
        "marker": _MARKERS[style.marker],
        "markersize": style.size,
    }


def _set_axis(axes: Any, name: str, axis: Axis) -> None:
    """Set title, scale, limit and direction of the axis of a name: x, y or z."""
    axes.set(**{f"{name}label": axis.title})
    if axis.log:
        axes.set(**{f"{name}scale": "log"})
    if axis.lower_limit is not None:
        getattr(axes, f"set_{name}lim")(axis.lower_limit, None)
    if axis.reversed:
        getattr(axes, f"invert_{name}axis")()
