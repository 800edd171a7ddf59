"""Self-contained HTML pages: they need no network and no server."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs


def write_page(path: Path, title: str, sections: Iterable[str], scripts: Sequence[str] = ()) -> Path:
    """Write a page of sections of HTML; returns its path.

    Args:
        path: file to write.
        title: of the page.
        sections: HTML.
        scripts: names of files in `web/`, besides that of the figures.
    """
    code = "".join(f"<script>{text}</script>" for text in (get_plotlyjs(), *map(_web, ("page.js", *scripts))))
    page = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>"
        f"<link rel='icon' href='data:,'><style>{_web('page.css')}</style>{code}</head><body><h1>{escape(title)}</h1>"
        f"{''.join(sections)}</body></html>"
    )
    path.write_text(page, encoding="utf-8")
    return path


def _web(name: str) -> str:
    return (files("formation_gnc.analysis") / "web" / name).read_text(encoding="utf-8")


def side_by_side(sections: Iterable[str]) -> str:
    """Sections in as many columns as there is room for."""
    return f'<div class="columns">{"".join(sections)}</div>'


def section(heading: str, figure: go.Figure, over_time: bool = False) -> str:
    """A figure under its heading, with a button that saves it as SVG.

    Args:
        heading: of the figure.
        figure: drawn once it comes into sight.
        over_time: whether its x axes are times in h, at which the page moves a cursor.
    """
    mark = " data-over-time" if over_time else ""
    return (
        f'<section class="figure"><h2>{escape(heading)}</h2><button class="svg" title="save as SVG">SVG</button>'
        f'<div class="plot"{mark} style="height: {figure.layout.height}px"></div>{data(figure.to_json())}</section>'
    )


def data(json: str) -> str:
    """JSON in a page; text in it never ends the element."""
    escaped = json.replace("<", "\\u003c")
    return f'<script type="application/json">{escaped}</script>'


def table(values: Mapping[str, Any]) -> str:
    """Names and values."""
    rows = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in values.items())
    return f"<table>{rows}</table>"


def table_of(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Rows below a head."""
    top = "".join(f"<th>{escape(each)}</th>" for each in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table class='rows'><tr>{top}</tr>{body}</table>"
