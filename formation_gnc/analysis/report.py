"""A whole run as one self-contained HTML page, of bounded size whatever the length of the bag."""

from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from formation_gnc.analysis.metrics import deputies_of
from formation_gnc.interface import Matrix, Sensor, Vector
from formation_gnc.recording.reader import Bag

POINTS = 2000
"""Points that a curve is drawn with at most."""

SLIDER_STEPS = 120
MARKS = 300
"""Events and eclipses that are marked and listed at most, each."""

AXES = ("x radial", "y along-track", "z cross-track")
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c")
MARK_COLOURS = {"miss": "#d62728", "fallback": "#e377c2", "parameters": "#9467bd", "acquired": "#17becf"}
UNITS = {
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


class _Thinned:
    """Rows of numbers in order, every so many-th kept, so that there are never more than twice POINTS."""

    def __init__(self, width: int) -> None:
        self.rows: Matrix = np.empty((0, width))
        self._stride, self._seen = 1, 0

    def add(self, rows: Matrix) -> None:
        index = np.arange(self._seen, self._seen + len(rows))
        self._seen += len(rows)
        self.rows = np.concatenate((self.rows, rows[index % self._stride == 0]))
        while len(self.rows) > 2 * POINTS:
            self.rows = self.rows[::2]
            self._stride *= 2


class _Ticks:
    """Columns of a topic at every so many-th tick, the same ticks for every topic."""

    def __init__(self, bag: Bag) -> None:
        count = bag.topics["/truth"].count
        first = next(bag.batches("/truth", 2))["stamp_ns"]
        self._start = int(first[0])
        self.tick_ns = int(first[-1] - first[0])
        self._step = max(1, self.tick_ns * -(-count // POINTS))

    def keep(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        kept: NDArray[np.bool_] = (stamps - self._start) % self._step == 0
        return kept

    def read(self, bag: Bag, topic: str, fields: Sequence[str]) -> dict[str, Any]:
        parts: dict[str, list[Any]] = {name: [] for name in ("stamp_ns", *fields)}
        for batch in bag.batches(topic) if topic in bag.topics else ():
            kept = self.keep(batch["stamp_ns"])
            for name, part in parts.items():
                part.append(batch[name][kept])
        return {name: np.concatenate(part) if part else np.zeros(0) for name, part in parts.items()}


def write_report(bag: Bag, path: Path, title: str) -> Path:
    """Write the page; it needs no network and no server.

    Returns:
        Its path.

    Raises:
        ConfigurationError: the bag has no truth.
    """
    names = deputies_of_first(bag)
    ticks = _Ticks(bag)
    events = _events(bag)
    flown = {name: _Deputy(bag, ticks, index, name) for index, name in enumerate(names)}
    sections = [_section("Relative trajectory", _trajectory(flown), True)]
    for name, deputy in flown.items():
        sections.append(_section(f"{name}: errors, thrust and timing", _history(deputy, events)))
        sections.append(_section(f"{name}: measurements and innovations", _readings(deputy, events)))
    spent = {f"delta-v of {name}": f"{1e3 * deputy.spent:.3f} mm/s" for name, deputy in flown.items()}
    summary = {
        "simulated time": f"{bag.topics['/truth'].count * ticks.tick_ns / 1e9:g} s",
        "ticks": bag.topics["/truth"].count,
        **spent,
        **{f"events: {kind}": count for kind, count in sorted(events.counts.items())},
    }
    if bag.damage:
        summary["damage"] = bag.damage
    tables = [f"<h2>Summary</h2>{_table(summary)}", events.listed(), "<h2>Parameters and provenance</h2>"]
    for name, values in sorted(bag.metadata.items()):
        tables.append(f"<details><summary>{escape(name)}</summary>{_table(values)}</details>")
    page = (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<link rel='icon' href='data:,'><style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>"
        f"{tables[0]}{''.join(sections)}{''.join(tables[1:])}</body></html>"
    )
    path.write_text(page, encoding="utf-8")
    return path


def deputies_of_first(bag: Bag) -> list[str]:
    """Names of the deputies, by the bag's first truth alone."""
    if "/truth" not in bag.topics or bag.topics["/truth"].count == 0:
        return deputies_of(bag)  # says what is missing
    first = next(bag.batches("/truth", 1))
    return [str(first[f"deputies.{i}.name"][0]) for i in range(sum(key.endswith(".name") for key in first))]


class _Events:
    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.marks: list[tuple[float, str, str, str]] = []
        """Time in h, kind, node, detail."""

    def listed(self) -> str:
        rows = "".join(
            f"<tr><td>{3600.0 * time:.3f}</td>{''.join(f'<td>{escape(word)}</td>' for word in words)}</tr>"
            for time, *words in self.marks
        )
        more = self.counts.total() - len(self.marks)
        rest = f"<p>and {more} more</p>" if more else ""
        head = "<tr><th>time [s]</th><th>kind</th><th>node</th><th>detail</th></tr>"
        return f"<h2>Events</h2><table>{head}{rows}</table>{rest}"


def _events(bag: Bag) -> _Events:
    events = _Events()
    for batch in bag.batches("/events") if "/events" in bag.topics else ():
        kinds = [str(kind) for kind in batch["kind"]]
        events.counts.update(kinds)
        room = MARKS - len(events.marks)
        rows = zip(batch["time"], kinds, batch["node"], batch["detail"], strict=True)
        events.marks += [(float(t) / 3600.0, k, str(n), str(d)) for t, k, n, d in rows][:room]
    return events


class _Deputy:
    """What the page shows of one deputy, thinned while it is read."""

    def __init__(self, bag: Bag, ticks: _Ticks, index: int, name: str) -> None:
        self.name = name
        prefix = f"deputies.{index}."
        stamps, states, forces = [], [], []
        self.spent, dark = 0.0, False
        self.eclipses: list[list[float]] = []
        tick = ticks.tick_ns * 1e-9
        for batch in bag.batches("/truth"):
            kept = ticks.keep(batch["stamp_ns"])
            acceleration = batch[f"{prefix}applied_force"] / batch[f"{prefix}mass"][:, None]
            total = self.spent + np.cumsum(np.abs(acceleration).sum(axis=1)) * tick
            self.spent = float(total[-1])
            stamps.append(batch["stamp_ns"][kept])
            states.append(batch[f"{prefix}relative_state"][kept])
            forces.append(np.column_stack((acceleration, total))[kept])
            shadow = np.concatenate(([dark], batch[f"{prefix}eclipse"].astype(bool)))
            for row in np.flatnonzero(shadow[1:] != shadow[:-1]):
                time = float(batch["time"][row]) / 3600.0
                if shadow[row + 1]:
                    self.eclipses.append([time, bag.end_ns / 3.6e12])
                else:
                    self.eclipses[-1][1] = time
            dark = bool(shadow[-1])
        self.eclipses = self.eclipses[:MARKS]
        self.stamps = np.concatenate(stamps)
        self.time = self.stamps / 3.6e12
        self.truth, self.thrust = np.concatenate(states), np.concatenate(forces)
        estimate = ticks.read(bag, f"/{name}/estimate", ("relative_state", "covariance"))
        target = ticks.read(bag, f"/{name}/target", ("relative_state",))
        self.error, self.error_time = self._against_truth(estimate)
        self.control, self.control_time = self._against_truth(target)
        covariance = estimate["covariance"].reshape(-1, 6, 6)
        self.sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        self.sigma_time = estimate["stamp_ns"] / 3.6e12
        self.target = target["relative_state"].reshape(-1, 6)
        self.readings = _by_sensor(bag, f"/{name}/measurement", ("reading",))
        self.innovations = _by_sensor(bag, f"/{name}/estimate", ("innovation", "innovation_sigma"))
        self.timing = _timing(bag, f"/{name}/timing")

    def _against_truth(self, other: Mapping[str, Any]) -> tuple[Matrix, Vector]:
        both, rows, others = np.intersect1d(self.stamps, other["stamp_ns"], return_indices=True)
        if not len(both):
            return np.zeros((0, 6)), np.zeros(0)
        return other["relative_state"][others] - self.truth[rows], both / 3.6e12


def _by_sensor(bag: Bag, topic: str, fields: Sequence[str]) -> dict[int, Matrix]:
    """Rows of time (h) and values, by sensor."""
    found: dict[int, _Thinned] = {}
    for batch in bag.batches(topic) if topic in bag.topics else ():
        rows: dict[int, list[list[float]]] = {}
        for row in np.flatnonzero([len(sensors) > 0 for sensors in batch["sensor"]]):
            time = float(batch["time"][row]) / 3600.0
            values = [batch[name][row] for name in fields]
            for place, sensor in enumerate(batch["sensor"][row]):
                if all(place < len(each) for each in values):
                    rows.setdefault(int(sensor), []).append([time, *(float(each[place]) for each in values)])
        for sensor, each in rows.items():
            found.setdefault(sensor, _Thinned(1 + len(fields))).add(np.array(each))
    return {sensor: found[sensor].rows for sensor in sorted(found)}


def _timing(bag: Bag, topic: str) -> dict[str, Matrix]:
    """Rows of time (h) and compute time (ms), by node."""
    found: dict[str, _Thinned] = {}
    for batch in bag.batches(topic) if topic in bag.topics else ():
        for node in np.unique(batch["node"].astype(str)):
            own = batch["node"] == node
            rows = np.column_stack((batch["time"][own] / 3600.0, 1e3 * batch["compute_time"][own]))
            found.setdefault(str(node), _Thinned(2)).add(rows)
    return {node: found[node].rows for node in sorted(found)}


def _trajectory(flown: Mapping[str, _Deputy]) -> go.Figure:
    """Paths and targets in the Hill frame, with a slider that moves every deputy along its path."""
    figure = go.Figure()
    figure.add_scatter3d(
        x=[0], y=[0], z=[0], mode="markers", name="chief", marker={"size": 5, "color": "black"}
    )
    for colour, deputy in zip(COLOURS * len(flown), flown.values(), strict=False):
        for label, states, dash in (("path", deputy.truth, "solid"), ("target", deputy.target, "dash")):
            line = {"color": colour if label == "path" else "#d62728", "dash": dash, "width": 3}
            mode = "lines" if label == "path" else "lines+markers"
            figure.add_scatter3d(
                x=states[:, 1],
                y=states[:, 0],
                z=states[:, 2],
                mode=mode,
                name=f"{deputy.name} {label}",
                line=line,
                marker={"size": 2, "color": line["color"]},
            )
    moving = len(figure.data)
    for colour, deputy in zip(COLOURS * len(flown), flown.values(), strict=False):
        x, y, z = deputy.truth[0, :3]
        marker = {"size": 6, "color": colour, "line": {"color": "black", "width": 1}}
        figure.add_scatter3d(
            x=[y], y=[x], z=[z], mode="markers", name=f"{deputy.name} at time", marker=marker
        )
    first = next(iter(flown.values()))
    frames, steps = [], []
    for row in np.unique(np.linspace(0, len(first.time) - 1, SLIDER_STEPS).round().astype(int)):
        name = f"{3600.0 * first.time[row]:.0f}"
        places = [
            go.Scatter3d(x=[d.truth[row, 1]], y=[d.truth[row, 0]], z=[d.truth[row, 2]])
            for d in flown.values()
        ]
        frames.append(go.Frame(name=name, data=places, traces=list(range(moving, moving + len(flown)))))
        now = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
        steps.append({"label": name, "method": "animate", "args": [[name], now]})
    figure.frames = frames
    figure.update_layout(
        height=650,
        margin={"t": 20, "b": 20, "l": 0, "r": 0},
        scene={
            "xaxis_title": "y along-track [m]",
            "yaxis_title": "x radial [m]",
            "zaxis_title": "z cross-track [m]",
            "aspectmode": "auto",  # a cube when a path is much longer than wide
        },
        sliders=[{"steps": steps, "currentvalue": {"prefix": "time [s]: "}, "pad": {"t": 30}}],
    )
    return figure


def _history(deputy: _Deputy, events: _Events) -> go.Figure:
    labels = ("estimate - truth [m]", "estimate - truth [m/s]", "truth - target [m]", "thrust [µm/s²]")
    rows = [*labels, "delta-v [mm/s]", *(["compute time [ms]"] if deputy.timing else [])]
    figure = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.02)
    for axis, (label, colour) in enumerate(zip(AXES, COLOURS, strict=True)):
        for row, offset in ((1, 0), (2, 3)):
            bound = 3.0 * deputy.sigma[:, axis + offset] if len(deputy.sigma) else np.zeros(0)
            for sign in (-1.0, 1.0):
                dotted = {"color": colour, "dash": "dot", "width": 1}
                _line(
                    figure,
                    row,
                    deputy.sigma_time,
                    sign * bound,
                    f"{label} 3σ",
                    dotted,
                    row == 1 and sign > 0.0,
                )
            _line(
                figure,
                row,
                deputy.error_time,
                deputy.error[:, axis + offset],
                label,
                {"color": colour},
                row == 1,
            )
        _line(figure, 3, deputy.control_time, -deputy.control[:, axis], label, {"color": colour})
        _line(figure, 4, deputy.time, 1e6 * deputy.thrust[:, axis], label, {"color": colour})
    _line(figure, 5, deputy.time, 1e3 * deputy.thrust[:, 3], "delta-v", {"color": "grey"}, True)
    for node, values in deputy.timing.items():
        _line(figure, 6, values[:, 0], values[:, 1], node, {"width": 1}, True)
    for row, text in enumerate(rows, 1):
        figure.update_yaxes(title_text=text, row=row, col=1)
    figure.update_xaxes(title_text="time [h]", row=len(rows), col=1)
    figure.update_layout(height=1250, margin={"t": 30, "r": 20}, legend={"groupclick": "togglegroup"})
    _mark(figure, deputy, events, 1)
    return figure


def _readings(deputy: _Deputy, events: _Events) -> go.Figure:
    sensors = sorted(deputy.readings.keys() | deputy.innovations.keys())
    figure = make_subplots(rows=max(1, len(sensors)), cols=2, shared_xaxes="all", vertical_spacing=0.05)
    for row, sensor in enumerate(sensors, 1):
        name = Sensor(sensor).name.lower() if sensor in list(Sensor) else f"sensor {sensor}"
        unit, scale = UNITS.get(Sensor(sensor), ("", 1.0)) if sensor in list(Sensor) else ("", 1.0)
        points = {"size": 3}
        read = deputy.readings.get(sensor, np.zeros((0, 2)))
        figure.add_scattergl(
            x=read[:, 0], y=scale * read[:, 1], mode="markers", marker=points, name=name, row=row, col=1
        )
        figure.update_yaxes(title_text=f"{name} [{unit}]", row=row, col=1)
        innovation = deputy.innovations.get(sensor, np.zeros((0, 3)))
        figure.add_scattergl(
            x=innovation[:, 0],
            y=scale * innovation[:, 1],
            mode="markers",
            marker=points,
            name=f"{name} innovation",
            row=row,
            col=2,
        )
        for sign in (-3.0, 3.0):
            bound = sign * scale * innovation[:, 2]
            _line(figure, row, innovation[:, 0], bound, "3σ", {"color": "grey", "dash": "dot"}, col=2)
        figure.update_yaxes(title_text=f"innovation [{unit}]", row=row, col=2)
    figure.update_xaxes(title_text="time [h]", row=max(1, len(sensors)))
    figure.update_layout(height=260 * max(1, len(sensors)) + 60, margin={"t": 30, "r": 20})
    _mark(figure, deputy, events, 2)
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


def _mark(figure: go.Figure, deputy: _Deputy, events: _Events, columns: int) -> None:
    """Mark eclipses and events over the whole height, on the time axis of every column."""
    shapes: list[dict[str, Any]] = []
    named: set[str] = set()

    def add(kind: str, **shape: Any) -> None:
        for column in range(columns):
            place = {"xref": "x" if column == 0 else f"x{column + 1}", "yref": "paper", "y0": 0, "y1": 1}
            legend = {"name": kind, "legendgroup": kind, "showlegend": kind not in named}
            shapes.append({**place, **legend, **shape})
            named.add(kind)

    for start, end in deputy.eclipses:
        quiet = {"fillcolor": "#888", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}
        add("eclipse", type="rect", x0=start, x1=end, **quiet)
    for time, kind, node, detail in events.marks:
        if node.startswith(f"/{deputy.name}/") or (
            node.count("/") < 2 and (deputy.name in detail or kind == "end")
        ):
            line = {"color": MARK_COLOURS.get(kind, "#555"), "width": 1, "dash": "dash"}
            add(kind, type="line", x0=time, x1=time, line=line)
    figure.update_layout(shapes=shapes)


def _section(title: str, figure: go.Figure, first: bool = False) -> str:
    body = figure.to_html(
        full_html=False, include_plotlyjs=first, auto_play=False, config={"displaylogo": False}
    )
    return f"<h2>{escape(title)}</h2>{body}"


def _table(values: Mapping[str, Any]) -> str:
    rows = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in values.items())
    return f"<table>{rows}</table>"
