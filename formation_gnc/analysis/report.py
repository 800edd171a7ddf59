"""A recorded run as one self-contained HTML page, of bounded size whatever the length of the bag."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from formation_gnc.analysis.figure_table import FIGURES
from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.page import section, table, write_page
from formation_gnc.analysis.panels.panel import Panel
from formation_gnc.analysis.panels.registry import DEPUTY_PANELS, FLEET_PANELS
from formation_gnc.analysis.plot import Plot
from formation_gnc.analysis.plotly_renderer import draw_columns, draw_space
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.timeline import Timeline
from formation_gnc.flight import topics
from formation_gnc.recording.reader import Bag
from formation_gnc.types import NANOSECONDS


def write_report(bag: Bag, run: RunHistory, path: Path, title: str) -> Path:
    """Write the page; it needs no network and no server.

    Args:
        bag: of the run.
        run: its history.
        path: file to write.
        title: of the page.

    Returns:
        The path.
    """
    charts = _figures(run, FLEET_PANELS, run.timeline)
    for name, deputy in run.deputies.items():
        own = _figures(deputy, DEPUTY_PANELS, run.timeline_of(name))
        charts |= {f"{name}: {heading}": figure for heading, figure in own.items()}
    sections = [f"<h2>Summary</h2>{table(_summary(run, bag))}<h2>Figures</h2>{_figure_table(bag)}"]
    sections += [section(heading, figure, number == 0) for number, (heading, figure) in enumerate(charts.items())]
    sections += [_event_table(run), "<h2>Parameters and provenance</h2>"]
    sections += [
        f"<details><summary>{escape(name)}</summary>{table(values)}</details>"
        for name, values in sorted(bag.metadata.items())
    ]
    return write_page(path, title, sections)


def _figures[H](history: H, panels: Sequence[Panel[H]], timeline: Timeline) -> dict[str, go.Figure]:
    """Figures by heading: one for each section that has something to show."""
    figures = {}
    for heading in dict.fromkeys(panel.heading for panel in panels):
        columns: dict[int, list[Plot]] = {}
        for panel in panels:
            if panel.heading == heading:
                columns.setdefault(panel.column, []).extend(panel.plots(history))
        plots = [plot for column in columns.values() for plot in column]
        if plots:
            in_space = plots[0].z is not None
            figures[heading] = draw_space(plots[0]) if in_space else draw_columns(list(columns.values()), timeline)
    return figures


def _summary(run: RunHistory, bag: Bag) -> dict[str, Any]:
    ticks = bag.topics[topics.TRUTH.name].count
    span = (bag.end_ns - bag.start_ns) / NANOSECONDS
    rows: dict[str, Any] = {"simulated time": f"{span:g} s", "ticks": ticks}
    if run.nearest is not None:
        near = run.nearest
        rows["nearest approach"] = f"{near.distance:.1f} m, {' and '.join(near.pair)} at {near.time:g} s"
    rows |= {f"events: {kind}": count for kind, count in sorted(run.event_counts.items())}
    rows["messages not recorded"] = bag.lost
    rows |= {f"note {number}": remark for number, remark in enumerate(bag.remarks, 1)}
    return rows


def _figure_table(bag: Bag) -> str:
    """Figures of merit of the deputies, and the law that each flew at the end."""
    deputies = figures(bag).deputies
    values = {name: each.by_name() for name, each in deputies.items()}
    head = "".join(f"<th>{escape(name)}</th>" for name in deputies)
    rows = [("control law at the end", [each.law for each in deputies.values()])]
    rows += [("mode at the end", [each.mode for each in deputies.values()])]
    rows += [(figure.label, [figure.text(values[name][figure.name]) for name in deputies]) for figure in FIGURES]
    body = "".join(
        f"<tr><th>{escape(label)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for label, cells in rows
    )
    return f"<table><tr><th></th>{head}</tr>{body}</table>"


def _event_table(run: RunHistory) -> str:
    rows = "".join(
        f"<tr><td>{3600.0 * mark.time:.3f}</td>"
        + "".join(f"<td>{escape(word)}</td>" for word in (mark.kind, mark.subject, mark.node, mark.detail))
        + "</tr>"
        for mark in run.events
    )
    more = run.event_counts.total() - len(run.events)
    rest = f"<p>and {more} more</p>" if more else ""
    head = "<tr><th>time [s]</th><th>kind</th><th>subject</th><th>node</th><th>detail</th></tr>"
    return f"<h2>Events</h2><table>{head}{rows}</table>{rest}"
