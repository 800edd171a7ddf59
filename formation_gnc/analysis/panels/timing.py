"""Compute time of the modules."""

from itertools import cycle

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import COLOURS, TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """Wall time of each module by tick, for runs on the node graph."""
    curves = [
        Curve(module, rows[:, 0], rows[:, 1], Style(colour))
        for colour, (module, rows) in zip(cycle(COLOURS), deputy.timing.items())
    ]
    return [Plot("compute time", TIME, Axis("compute time", "ms", log=True), curves)] if curves else []


TIMING = DeputyPanel("timing", plots, HISTORY, in_overview=False)
