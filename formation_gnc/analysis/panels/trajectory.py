"""Trajectories of all deputies in space."""

from itertools import cycle

import numpy as np

from formation_gnc.analysis.panels.panel import FleetPanel
from formation_gnc.analysis.plot import BLACK, COLOURS, Axis, Curve, Plot, Style, Track
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.types import Matrix

TARGETS = 120
"""Points that a target is drawn with at most."""


def plots(run: RunHistory) -> list[Plot]:
    """Paths, targets and the moving deputies in the Hill frame."""
    curves, tracks = [_curve("chief", np.zeros((1, 3)), Style(BLACK, "none", marker="dot", size=3.5))], []
    for colour, (name, deputy) in zip(cycle(COLOURS), run.deputies.items()):
        curves.append(_curve(f"{name} path", deputy.truth, Style(colour, width=2.0)))
        target = deputy.target[:: max(1, -(-len(deputy.target) // TARGETS))]
        curves.append(_curve(f"{name} target", target, Style(colour, "none", marker="diamond", size=1.7)))
        moving = Style(colour, "none", marker="dot", size=4.0)
        tracks.append(Track(f"{name} at time", deputy.time, deputy.truth[:, [1, 0, 2]], moving))
    axes = Axis("y along-track", "m"), Axis("x radial", "m")
    return [Plot("relative trajectory", *axes, curves, z=Axis("z cross-track", "m"), tracks=tracks)]


def _curve(label: str, states: Matrix, style: Style) -> Curve:
    return Curve(label, states[:, 1], states[:, 0], style, z=states[:, 2])


TRAJECTORY = FleetPanel("trajectory", plots, "Relative trajectory")
