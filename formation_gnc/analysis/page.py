"""Self-contained HTML pages: they need no network and no server."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 1280px; padding: 0 1rem; }
table { border-collapse: collapse; font-size: 13px; display: block; overflow-x: auto }
td, th { border: 1px solid #ddd; padding: 2px 8px }
th { text-align: left; background: #f5f5f5 } details { margin: .4rem 0 } summary { cursor: pointer }
"""


def write_page(path: Path, title: str, sections: Iterable[str]) -> Path:
    """Write a page of sections of HTML; returns its path."""
    page = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>"
        f"<link rel='icon' href='data:,'><style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>"
        f"{''.join(sections)}</body></html>"
    )
    path.write_text(page, encoding="utf-8")
    return path


def section(heading: str, figure: go.Figure, with_library: bool) -> str:
    """A figure under its heading; the first of a page brings the library."""
    config = {"displaylogo": False, "responsive": True}
    body = figure.to_html(full_html=False, include_plotlyjs=with_library, auto_play=False, config=config)
    return f"<h2>{escape(heading)}</h2>{body}"


def table(values: Mapping[str, Any]) -> str:
    """Names and values."""
    rows = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in values.items())
    return f"<table>{rows}</table>"


def table_of(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Rows below a head."""
    top = "".join(f"<th>{escape(each)}</th>" for each in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"
