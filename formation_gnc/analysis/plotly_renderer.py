"""Plots drawn with Plotly, for the page."""

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from formation_gnc.analysis.plot import Axis, Curve, Plot, Style
from formation_gnc.analysis.timeline import Timeline
from formation_gnc.types import Vector

_ROW_HEIGHT = 210  # px
_LARGE_HEIGHT = 520  # px, of a plot that is not over time
_LINES = {"solid": "solid", "dashed": "dash", "dotted": "dot"}
_MARKERS = {"dot": "circle", "star": "star", "diamond": "diamond-open"}
_PIXELS = 1.5  # per point
_EQUAL = 1e-6
"""Difference of equal steps, relative: far less than a pixel over all of them."""
_LEGEND = {"orientation": "h", "yanchor": "top", "xanchor": "left", "x": 0.0}  # below, so that plots have the width


def draw_columns(columns: Sequence[Sequence[Plot]], timeline: Timeline) -> go.Figure:
    """Figure with columns of plots; the time axes of all are one and have the timeline marked."""
    rows = list(zip_longest(*columns))
    plots = [plot for column in columns for plot in column]
    over_time = all(plot.over_time for plot in plots)
    figure = make_subplots(
        rows=len(rows),
        cols=len(columns),
        shared_xaxes="all" if over_time else False,
        vertical_spacing=0.14 / len(rows),
        specs=[[{"secondary_y": plot is not None and plot.right is not None} for plot in row] for row in rows],
    )
    shown: set[str] = set()
    for row, each in enumerate(rows, 1):
        for column, plot in enumerate(each, 1):
            if plot is not None:
                _add_plot(figure, row, column, plot, shown)
                if not over_time or row == len(rows):
                    figure.update_xaxes(title_text=plot.x.title, row=row, col=column)
    if over_time:
        _mark(figure, timeline, len(columns))
    height = sum(_ROW_HEIGHT if any(plot and plot.over_time for plot in row) else _LARGE_HEIGHT for row in rows)
    figure.update_layout(height=height + 160, margin={"t": 30, "r": 20}, template="plotly_white")
    figure.update_layout(legend={"groupclick": "togglegroup", **_LEGEND, "y": -60.0 / height})
    return figure


def _add_plot(figure: go.Figure, row: int, column: int, plot: Plot, shown: set[str]) -> None:
    """Add a plot; `shown` has the labels that are in the legend of the figure."""
    for curve in plot.curves:
        if not len(curve.x):
            continue
        place = {"row": row, "col": column} | ({"secondary_y": curve.right} if plot.right else {})
        legend = {"name": curve.label, "legendgroup": curve.label, "showlegend": curve.label not in shown}
        figure.add_trace(_trace(curve, **legend, **_look(curve.style)), **place)
        shown.add(curve.label)
    place = {"row": row, "col": column} | ({"secondary_y": False} if plot.right else {})
    figure.update_xaxes(**_axis(plot.x), row=row, col=column)
    figure.update_yaxes(title_text=plot.y.title, **_axis(plot.y), **place)
    if plot.right:
        right = {"title_text": plot.right.title, "showgrid": False, "tickmode": "auto"}
        figure.update_yaxes(**right, **_axis(plot.right), **(place | {"secondary_y": True}))
    if plot.equal:
        figure.update_yaxes(scaleanchor="x", row=row, col=column)


def _trace(curve: Curve, **properties: Any) -> Any:
    kind = go.Scattergl if curve.style.line == "none" else go.Scatter
    with np.errstate(over="ignore", invalid="ignore"):
        return kind(**_places(curve.x), y=curve.y.astype(np.float32), **properties)  # half of the page


def _places(x: Vector) -> dict[str, Any]:
    """The x of a trace: begin and step where the steps are equal, which halves the page once more."""
    steps = np.diff(x)
    if len(steps) > 1 and steps[0] > 0.0 and np.ptp(steps) <= _EQUAL * steps[0]:
        return {"x0": float(x[0]), "dx": float((x[-1] - x[0]) / len(steps))}
    return {"x": x.astype(np.float32)}


def _look(style: Style) -> dict[str, Any]:
    if style.line == "none":
        marker = {"size": _PIXELS * style.size, "color": style.colour, "symbol": _MARKERS[style.marker]}
        return {"mode": "markers", "marker": marker}
    line = {"color": style.colour, "width": _PIXELS * style.width, "dash": _LINES[style.line]}
    return {"mode": "lines", "line": line}


def _axis(axis: Axis) -> dict[str, Any]:
    """Scale, limit and direction."""
    properties: dict[str, Any] = {"type": "log"} if axis.log else {}
    if axis.lower_limit is not None:
        properties["autorangeoptions"] = {"clipmin": axis.lower_limit, "include": axis.lower_limit}
    if axis.reversed:
        properties["autorange"] = "reversed"
    return properties


def _mark(figure: go.Figure, timeline: Timeline, columns: int) -> None:
    """Mark eclipses and events over the whole height of every column."""
    shapes: list[dict[str, Any]] = []
    shown: set[str] = set()

    def add(label: str, **shape: Any) -> None:
        for column in range(columns):
            place = {"xref": "x" if column == 0 else f"x{column + 1}", "yref": "paper", "y0": 0, "y1": 1}
            legend = {"name": label, "legendgroup": label, "showlegend": label not in shown}
            shapes.append({**place, **legend, **shape})
            shown.add(label)

    for begin, end in timeline.eclipses:
        look = {"fillcolor": "#888", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}
        add("eclipse", type="rect", x0=begin, x1=end, **look)
    for mark in timeline.events:
        line = {"color": timeline.colours[mark.kind], "width": 1, "dash": "dash"}
        add(mark.kind, type="line", x0=mark.time, x1=mark.time, line=line)
    figure.update_layout(shapes=shapes)
