"""Iterations of the solver."""

import numpy as np

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import BROWN, TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """Iterations by tick, for laws that iterate."""
    time, iterations = deputy.solver.T
    if not np.any(iterations):
        return []
    return [Plot("solver", TIME, Axis("solver iterations"), [Curve("iterations", time, iterations, Style(BROWN))])]


SOLVER = DeputyPanel("solver", plots, HISTORY, in_overview=False)
