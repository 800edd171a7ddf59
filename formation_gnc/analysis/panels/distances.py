"""Distances between deputies."""

from itertools import cycle

from formation_gnc.analysis.panels.panel import FleetPanel
from formation_gnc.analysis.plot import COLOURS, TIME, Axis, Curve, Plot, Style
from formation_gnc.analysis.run_history import RunHistory

PAIRS = 10
"""Pairs drawn at most, those that came nearest."""


def plots(run: RunHistory) -> list[Plot]:
    """Distance of each pair."""
    if not run.distances:
        return []
    nearest = sorted(run.distances.items(), key=lambda item: float(item[1][:, 1].min()))[:PAIRS]
    curves = [
        Curve(" - ".join(pair), rows[:, 0], rows[:, 1], Style(colour))
        for colour, (pair, rows) in zip(cycle(COLOURS), nearest)
    ]
    return [Plot("distances between deputies", TIME, Axis("distance", "m", lower_limit=0.0), curves)]


DISTANCES = FleetPanel("distances", plots, "Distances between deputies")
