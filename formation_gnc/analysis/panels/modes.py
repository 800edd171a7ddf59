"""Modes as a band over time, above the faults that were injected, detected and answered."""

import numpy as np

from formation_gnc.analysis.deputy_history import HOUR, DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import BLACK, COLOURS, TIME, Axis, Curve, Plot, Style
from formation_gnc.analysis.supervision_history import Span
from formation_gnc.mode_records import Mode

MODE_COLOURS: dict[str, str] = {
    Mode.STANDBY: "#7f7f7f",
    Mode.ACQUIRE: "#ff7f0e",
    Mode.KEEP: "#2ca02c",
    Mode.RECONFIGURE: "#1f77b4",
    Mode.AVOID: "#e377c2",
    Mode.SAFE: "#d62728",
}

BAND, THIN = 9.0, 3.0
"""Width of the band of modes, and of the lines below it, points."""


def plots(deputy: DeputyHistory) -> list[Plot]:
    """The band at the top; a row for each fault that was injected, detected or answered below it."""
    history = deputy.supervision
    if not history.modes:
        return []
    curves = [
        _curve(f"mode {span.name}", span, 0.0, Style(MODE_COLOURS.get(span.name, BLACK), width=BAND))
        for span in history.modes
    ]
    row = 0.0
    if history.injected:
        row -= 1.0
        times = np.array([mark.time for mark in history.injected])
        style = Style(BLACK, line="none", marker="diamond", size=5.0)
        curves.append(Curve("faults injected: begin and end", times, np.full(len(times), row), style))
    for kind, spans in (("detected", history.detections), ("answered", history.responses)):
        for number, name in enumerate(dict.fromkeys(span.name for span in spans)):
            row -= 1.0
            style = Style(COLOURS[number % len(COLOURS)], "solid" if kind == "detected" else "dashed", THIN, "dot")
            curves += [_curve(f"{kind}: {name}", span, row, style) for span in spans if span.name == name]
    return [Plot("modes and faults", TIME, Axis("mode, faults below", lower_limit=row - 0.5), curves)]


def _curve(label: str, span: Span, level: float, style: Style) -> Curve:
    """Line from begin to end of a span."""
    return Curve(label, np.array([span.begin, span.end]) / HOUR, np.full(2, level), style)


MODES = DeputyPanel("modes", plots, HISTORY)
