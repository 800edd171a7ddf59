"""A whole run as one self-contained HTML page, of bounded size whatever the length of the bag."""

from collections.abc import Mapping, Sequence
from html import escape
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.colors import qualitative
from plotly.subplots import make_subplots

from formation_gnc.analysis.run_history import AXES, DeputyHistory, Mark, RunHistory
from formation_gnc.recording.reader import Bag
from formation_gnc.records import Sensor
from formation_gnc.types import Matrix, Vector

SLIDER_STEPS = 120
TARGETS = 120
"""Places at which a target is drawn in space."""

PAIRS = 10
"""Pairs of deputies whose distance is drawn at most, the nearest first."""

COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c")
FLEET = qualitative.Dark24
MARK_COLOURS = {"miss": "#d62728", "fallback": "#e377c2", "end": "#222222"}
OTHER_MARKS = ("#9467bd", "#17becf", "#8c564b", "#bcbd22", "#636efa", "#00a08b", "#b6316c", "#7f7f7f")
READINGS = {
    Sensor.RADIUS: ("km", 1e-3),
    Sensor.RANGE_RATE: ("m/s", 1.0),
    Sensor.LATITUDE: ("deg", 180.0 / np.pi),
    Sensor.RIGHT_ASCENSION: ("deg", 180.0 / np.pi),
    Sensor.CHIEF_RANGE: ("m", 1.0),
}
INNOVATIONS = {
    Sensor.RADIUS: ("m", 1.0),
    Sensor.RANGE_RATE: ("m/s", 1.0),
    Sensor.LATITUDE: ("µrad", 1e6),
    Sensor.RIGHT_ASCENSION: ("µrad", 1e6),
    Sensor.CHIEF_RANGE: ("m", 1.0),
}
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 1280px; padding: 0 1rem; }
table { border-collapse: collapse; font-size: 13px } td, th { border: 1px solid #ddd; padding: 2px 8px }
th { text-align: left; background: #f5f5f5 } details { margin: .4rem 0 } summary { cursor: pointer }
"""


def write_report(bag: Bag, flown: RunHistory, path: Path, title: str) -> Path:
    """Write the page; it needs no network and no server.

    Returns:
        Its path.

    Raises:
        ConfigurationError: the bag has no truth.
    """
    colours = _mark_colours(flown)
    sections = [_section("Relative trajectory", _trajectory(flown.deputies), True)]
    if flown.distances:
        sections.append(_section("Distances between deputies", _distances(flown, colours)))
    for name, deputy in flown.deputies.items():
        marks = flown.events_of(name)
        history, readings = _history(deputy), _readings(deputy)
        _mark(history, deputy.eclipses, marks, colours)
        _mark(readings, deputy.eclipses, marks, colours, columns=2)
        sections.append(_section(f"{name}: errors, thrust, solver and timing", history))
        sections.append(_section(f"{name}: measurements and innovations", readings))
    tables = [_table(_summary(flown, bag)), _listed(flown), "<h2>Parameters and provenance</h2>"]
    for name, values in sorted(bag.metadata.items()):
        tables.append(f"<details><summary>{escape(name)}</summary>{_table(values)}</details>")
    page = (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<link rel='icon' href='data:,'><style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>"
        f"<h2>Summary</h2>{tables[0]}{''.join(sections)}{''.join(tables[1:])}</body></html>"
    )
    path.write_text(page, encoding="utf-8")
    return path


def _summary(flown: RunHistory, bag: Bag) -> dict[str, Any]:
    ticks = bag.topics["/truth"].count
    rows: dict[str, Any] = {"simulated time": f"{ticks * flown.ticks.tick_ns / 1e9:g} s", "ticks": ticks}
    rows |= {f"delta-v of {name}": f"{1e3 * each.spent:.3f} mm/s" for name, each in flown.deputies.items()}
    if flown.nearest is not None:
        near = flown.nearest
        rows["nearest approach"] = f"{near.distance:.1f} m, {' and '.join(near.pair)} at {near.time:g} s"
    rows |= {f"events: {kind}": count for kind, count in sorted(flown.counts.items())}
    rows["messages not recorded"] = bag.lost
    if bag.damage:
        rows["damage"] = bag.damage
    return rows


def _listed(flown: RunHistory) -> str:
    """All events in a table."""
    rows = "".join(
        f"<tr><td>{3600.0 * mark.time:.3f}</td>"
        + "".join(f"<td>{escape(word)}</td>" for word in (mark.kind, mark.subject, mark.node, mark.detail))
        + "</tr>"
        for mark in flown.events
    )
    more = flown.counts.total() - len(flown.events)
    rest = f"<p>and {more} more</p>" if more else ""
    head = "<tr><th>time [s]</th><th>kind</th><th>subject</th><th>node</th><th>detail</th></tr>"
    return f"<h2>Events</h2><table>{head}{rows}</table>{rest}"


def _mark_colours(flown: RunHistory) -> dict[str, str]:
    """A colour for every kind of event of the run."""
    others = zip((kind for kind in sorted(flown.counts) if kind not in MARK_COLOURS), cycle(OTHER_MARKS))
    return MARK_COLOURS | dict(others)


def _trajectory(flown: Mapping[str, DeputyHistory]) -> go.Figure:
    """Paths and targets in the Hill frame, with a slider that moves every deputy along its path."""
    figure = go.Figure()

    def draw(states: Matrix, **style: Any) -> None:
        figure.add_scatter3d(x=states[:, 1], y=states[:, 0], z=states[:, 2], **style)

    draw(np.zeros((1, 3)), mode="markers", name="chief", marker={"size": 5, "color": "black"})
    for colour, (name, deputy) in zip(cycle(FLEET), flown.items()):
        draw(deputy.truth, mode="lines", name=f"{name} path", line={"color": colour, "width": 4})
        dots = {"size": 2.5, "color": colour, "symbol": "diamond-open"}
        few = deputy.target[:: max(1, len(deputy.target) // TARGETS)]
        draw(few, mode="markers", name=f"{name} target", marker=dots)
    moving = len(figure.data)
    for colour, (name, deputy) in zip(cycle(FLEET), flown.items()):
        ball = {"size": 6, "color": colour, "line": {"color": "black", "width": 1}}
        draw(deputy.truth[:1], mode="markers", name=f"{name} at time", marker=ball)
    first = next(iter(flown.values()))
    frames, steps = [], []
    for row in np.unique(np.linspace(0, len(first.time) - 1, SLIDER_STEPS).round().astype(int)):
        name = f"{3600.0 * first.time[row]:.0f}"
        places = [go.Scatter3d(x=[d.truth[row, 1]], y=[d.truth[row, 0]], z=[d.truth[row, 2]]) for d in flown.values()]
        frames.append(go.Frame(name=name, data=places, traces=list(range(moving, moving + len(flown)))))
        now = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
        steps.append({"label": name, "method": "animate", "args": [[name], now]})
    figure.frames = frames
    slider = {
        "steps": steps,
        "currentvalue": {"prefix": "time [s]: "},
        "pad": {"t": 20, "b": 20, "l": 20, "r": 20},
        "font": {"size": 10},
    }
    figure.update_layout(
        height=780,
        margin={"t": 40, "b": 50, "l": 0, "r": 0},
        template="plotly_white",
        scene={
            "xaxis_title": "y along-track [m]",
            "yaxis_title": "x radial [m]",
            "zaxis_title": "z cross-track [m]",
            "aspectmode": "auto",  # a cube when a path is much longer than wide
            "camera": {"eye": {"x": 1.5, "y": 1.5, "z": 0.9}, "center": {"x": 0, "y": 0, "z": -0.15}},
        },
        sliders=[slider],
    )
    return figure


def _distances(flown: RunHistory, colours: Mapping[str, str]) -> go.Figure:
    figure = make_subplots(rows=1, cols=1)
    nearest = sorted(flown.distances, key=lambda pair: float(flown.distances[pair][:, 1].min()))[:PAIRS]
    for colour, pair in zip(cycle(FLEET), nearest):
        rows = flown.distances[pair]
        _line(figure, 1, rows[:, 0], rows[:, 1], " - ".join(pair), {"color": colour}, True)
    figure.update_yaxes(title_text="distance [m]", rangemode="tozero")
    figure.update_xaxes(title_text="time [h]")
    figure.update_layout(height=440, margin={"t": 30, "r": 20})
    _mark(figure, [], flown.events, colours)
    return figure


def _history(deputy: DeputyHistory) -> go.Figure:
    rows = ["estimate - truth [m]", "estimate - truth [m/s]", "truth - target [m]", "thrust [µm/s²]"]
    rows.append("delta-v [mm/s]")
    if np.any(deputy.solver[:, 1]):
        rows.append("solver iterations")
    if deputy.timing:
        rows.append("compute time [ms]")
    figure = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.02)
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        solid, dotted = {"color": colour}, {"color": colour, "dash": "dot", "width": 1}
        for row, column in ((1, axis), (2, axis + 3)):
            for sign in (-3.0, 3.0):
                bound = sign * deputy.sigma[:, column]
                legend = row == 1 and sign > 0.0
                _line(figure, row, deputy.sigma_time, bound, f"{label} 3σ", dotted, legend)
            _line(figure, row, deputy.error_time, deputy.error[:, column], label, solid, row == 1)
        _line(figure, 3, deputy.control_time, deputy.control[:, axis], label, solid)
        _line(figure, 4, deputy.time, 1e6 * deputy.acceleration[:, axis], label, solid)
    _line(figure, 5, deputy.time, 1e3 * deputy.delta_v, "delta-v", {"color": "grey"}, True)
    if "solver iterations" in rows:
        solver = deputy.solver
        _line(figure, 6, solver[:, 0], solver[:, 1], "iterations", {"color": "#8c564b", "width": 1}, True)
    for node, values in deputy.timing.items():
        _line(figure, len(rows), values[:, 0], values[:, 1], node, {"width": 1}, True)
    if deputy.timing:
        figure.update_yaxes(type="log", row=len(rows), col=1)
    for row, text in enumerate(rows, 1):
        figure.update_yaxes(title_text=text, row=row, col=1)
    figure.update_xaxes(title_text="time [h]", row=len(rows), col=1)
    layout = {"height": 200 * len(rows) + 60, "margin": {"t": 30, "r": 20}}
    figure.update_layout(legend={"groupclick": "togglegroup"}, **layout)
    return figure


def _readings(deputy: DeputyHistory) -> go.Figure:
    sensors = sorted(deputy.readings.keys() | deputy.innovations.keys())
    count = max(1, len(sensors))
    figure = make_subplots(rows=count, cols=2, shared_xaxes="all", vertical_spacing=0.14 / count)
    for row, sensor in enumerate(sensors, 1):
        known = Sensor(sensor) if sensor in list(Sensor) else None
        name = known.name.lower().replace("_", " ") if known is not None else f"sensor {sensor}"
        unit, scale = READINGS[known] if known is not None else ("", 1.0)
        points = {"size": 3, "color": FLEET[sensor % len(FLEET)]}
        drawn = {"mode": "markers", "marker": points, "name": name, "legendgroup": name}
        read = deputy.readings.get(sensor, np.zeros((0, 2)))
        figure.add_scattergl(x=read[:, 0], y=scale * read[:, 1], row=row, col=1, **drawn)
        figure.update_yaxes(title_text=f"{name} [{unit}]", row=row, col=1)
        unit, scale = INNOVATIONS[known] if known is not None else ("", 1.0)
        innovation = deputy.innovations.get(sensor, np.zeros((0, 3)))
        time, values = innovation[:, 0], scale * innovation[:, 1]
        figure.add_scattergl(x=time, y=values, row=row, col=2, showlegend=False, **drawn)
        for sign in (-3.0, 3.0):
            bound = sign * scale * innovation[:, 2]
            _line(figure, row, time, bound, "3σ", {"color": "grey", "dash": "dot"}, col=2)
        figure.update_yaxes(title_text=f"innovation [{unit}]", row=row, col=2)
    figure.update_xaxes(title_text="time [h]", row=count)
    figure.update_layout(height=220 * count + 80, margin={"t": 30, "r": 20})
    return figure


def _line(
    figure: go.Figure,
    row: int,
    time: Vector,
    values: Vector,
    name: str,
    line: dict[str, Any],
    legend: bool = False,
    col: int = 1,
) -> None:
    figure.add_scatter(
        x=time,
        y=values,
        mode="lines",
        name=name,
        legendgroup=name,
        showlegend=legend,
        line=line,
        row=row,
        col=col,
    )


def _mark(
    figure: go.Figure,
    eclipses: Sequence[Sequence[float]],
    marks: Sequence[Mark],
    colours: Mapping[str, str],
    columns: int = 1,
) -> None:
    """Mark eclipses and events over the whole height, on the time axis of every column."""
    shapes: list[dict[str, Any]] = []
    named: set[str] = set()

    def add(kind: str, **shape: Any) -> None:
        for column in range(columns):
            place = {"xref": "x" if column == 0 else f"x{column + 1}", "yref": "paper", "y0": 0, "y1": 1}
            legend = {"name": kind, "legendgroup": kind, "showlegend": kind not in named}
            shapes.append({**place, **legend, **shape})
            named.add(kind)

    for start, end in eclipses:
        quiet = {"fillcolor": "#888", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}
        add("eclipse", type="rect", x0=start, x1=end, **quiet)
    for mark in marks:
        line = {"color": colours[mark.kind], "width": 1, "dash": "dash"}
        add(mark.kind, type="line", x0=mark.time, x1=mark.time, line=line)
    figure.update_layout(shapes=shapes, template="plotly_white")


def _section(title: str, figure: go.Figure, first: bool = False) -> str:
    body = figure.to_html(full_html=False, include_plotlyjs=first, auto_play=False, config={"displaylogo": False})
    return f"<h2>{escape(title)}</h2>{body}"


def _table(values: Mapping[str, Any]) -> str:
    rows = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in values.items())
    return f"<table>{rows}</table>"
