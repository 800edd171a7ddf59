"""A recorded run as one self-contained HTML page, of bounded size whatever the length of the bag."""

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from formation_gnc.analysis.figure_table import FIGURES
from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.page import data, section, table, write_page
from formation_gnc.analysis.panels.panel import Panel
from formation_gnc.analysis.panels.registry import DEPUTY_PANELS, FLEET_PANELS
from formation_gnc.analysis.plot import Plot
from formation_gnc.analysis.plotly_renderer import draw_columns
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.scene import scene_of
from formation_gnc.analysis.timeline import Timeline
from formation_gnc.flight import topics
from formation_gnc.recording.files import digest_of
from formation_gnc.recording.reader import Bag
from formation_gnc.types import NANOSECONDS

OPEN = 2
"""Deputies whose figures are unfolded."""


@dataclass(frozen=True)
class Origin:
    """Where a run on a page is from, and whether a replay gives it again.

    Attributes:
        name: of the bag, as its commands take it.
        digest: of the bag's files, SHA-256.
        differences: between the run and its replay, a line each; None when it was not replayed.
    """

    name: str
    digest: str
    differences: Sequence[str] | None = None


def write_report(bag: Bag, run: RunHistory, path: Path, title: str, origin: Origin | None = None) -> Path:
    """Write the page; it needs no network and no server.

    Args:
        bag: of the run.
        run: its history.
        path: file to write.
        title: of the page.
        origin: what its badge tells; by default where the bag is, not replayed.

    Returns:
        The path.
    """
    origin = origin or Origin(str(bag.path), digest_of(bag.source))
    sections = [_badge(origin), _replay(run, bag)]
    tables = {"Summary": table(_summary(run, bag)), "Figures": _figure_table(bag)}
    told = "".join(f"<div><h2>{heading}</h2>{each}</div>" for heading, each in tables.items())
    sections.append(f'<div class="tables">{told}</div>')
    sections += _figures(run, FLEET_PANELS, run.timeline)
    for number, (name, deputy) in enumerate(run.deputies.items()):
        own = "".join(_figures(deputy, DEPUTY_PANELS, run.timeline_of(name), f"{name}: "))
        shown = " open" * (number < OPEN)
        sections.append(f'<details class="deputy"{shown}><summary>{escape(name)}</summary>{own}</details>')
    sections += [_event_table(run), "<h2>Parameters and provenance</h2>"]
    sections += [
        f"<details><summary>{escape(name)}</summary>{table(values)}</details>"
        for name, values in sorted(bag.metadata.items())
    ]
    return write_page(path, title, sections, ("replay.js", "views.js"))


def _badge(origin: Origin) -> str:
    """Whether the replay gives the same bits, only if that was tried, and the digest of the bag."""
    if origin.differences is None:
        kind, claim = "", "<b>Not replayed.</b> Whether a replay gives the same bits is found out by"
    elif origin.differences:
        told = "".join(f"<br>{escape(line)}" for line in origin.differences)
        kind, claim = "differs", f"<b>The replay differs.</b>{told}<br>Found by"
    else:
        kind, claim = "same", "<b>The replay gives the same bits</b> on every GNC topic. Checked by"
    command = escape(f"formation-gnc replay {shlex.quote(origin.name)}")
    return (
        f'<p class="badge {kind}">{claim} <code>{command}</code>'
        f'<br>SHA-256 of the bag: <code class="digest">{origin.digest}</code></p>'
    )


def _replay(run: RunHistory, bag: Bag) -> str:
    """The two views, the controls of their time, and whom the colours of the track mean."""
    tools = '<button class="out" title="smaller">−</button><button class="in" title="larger">+</button>'
    tools += '<button class="save" title="save as SVG">SVG</button>'
    centres = "".join(f'<option value="{escape(name)}">{escape(name)}</option>' for name in run.deputies)
    choice = f'<select aria-label="centre"><option value="">whole formation</option>{centres}</select>'
    view = (
        '<figure class="view" aria-label="{}"><svg role="img"></svg><div class="tools">{}</div>'
        "<figcaption></figcaption></figure>"
    )
    views = view.format("orbit", tools) + view.format("formation", choice + tools)
    speeds = "".join(
        f'<option value="{speed}"{" selected" * (speed == 1)}>{word}</option>'
        for speed, word in ((0.1, "slowest"), (0.3, "slow"), (1, "normal"), (4, "fast"))
    )
    colours = run.timeline.colours
    keys = "".join(
        f'<span style="--key: {colours[kind]}">{escape(kind)}</span>'
        for kind in dict.fromkeys(mark.kind for mark in run.events)
    )
    keys += '<span style="--key: #8886">eclipse</span>' * any(each.eclipses for each in run.deputies.values())
    return (
        f'<div class="replay"><div class="views">{views}</div>{data(json.dumps(scene_of(run, bag)))}</div>'
        f'<div class="keys">{keys}</div><div class="time"><button>▶ play</button><div class="track"><svg></svg>'
        f'<input type="range" aria-label="time"></div><output></output>'
        f'<select aria-label="speed">{speeds}</select></div>'
    )


def _figures[H](history: H, panels: Sequence[Panel[H]], timeline: Timeline, prefix: str = "") -> Iterator[str]:
    """A figure for each section that has something to show in the plane; in space there is the replay."""
    for heading in dict.fromkeys(panel.heading for panel in panels):
        columns: dict[int, list[Plot]] = {}
        for panel in panels:
            if panel.heading == heading:
                plots = [plot for plot in panel.plots(history) if plot.z is None]
                columns.setdefault(panel.column, []).extend(plots)
        plots = [plot for column in columns.values() for plot in column]
        if plots:
            figure = draw_columns(list(columns.values()), timeline)
            yield section(f"{prefix}{heading}", figure, all(plot.over_time for plot in plots))


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
    values = {name: each.shown() for name, each in deputies.items()}
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
        f'<tr data-time="{3600.0 * mark.time:.3f}"><td>{3600.0 * mark.time:.3f}</td>'
        + "".join(f"<td>{escape(word)}</td>" for word in (mark.kind, mark.subject, mark.node, mark.detail))
        + "</tr>"
        for mark in run.events
    )
    more = run.event_counts.total() - len(run.events)
    rest = f"<p>and {more} more</p>" if more else ""
    head = "<tr><th>time [s]</th><th>kind</th><th>subject</th><th>node</th><th>detail</th></tr>"
    return f"<h2>Events</h2><table>{head}{rows}</table>{rest}"
