"""Estimation error with the standard deviations of the filter."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import AXIS_COLOURS, HILL_AXES, TIME, Axis, Curve, Plot, Style


def position(deputy: DeputyHistory) -> list[Plot]:
    """Position error and 3-sigma bounds."""
    return [_plot(deputy, "estimation error", 0, "m")]


def velocity(deputy: DeputyHistory) -> list[Plot]:
    """Velocity error and 3-sigma bounds."""
    return [_plot(deputy, "velocity estimation error", 3, "m/s")]


def _plot(deputy: DeputyHistory, title: str, first: int, unit: str) -> Plot:
    """Plot of three elements of the state."""
    curves = []
    for axis, (label, colour) in enumerate(zip(HILL_AXES, AXIS_COLOURS, strict=True), first):
        bound = 3.0 * deputy.sigma[:, axis]
        curves += [Curve("3σ", deputy.sigma_time, sign * bound, Style(colour, "dotted", 0.8)) for sign in (-1.0, 1.0)]
        curves.append(Curve(label, deputy.estimation_time, deputy.estimation_error[:, axis], Style(colour)))
    return Plot(title, TIME, Axis("estimate - truth", unit), curves)


POSITION_ERROR = DeputyPanel("estimation", position, HISTORY)
VELOCITY_ERROR = DeputyPanel("estimation_velocity", velocity, HISTORY, in_overview=False)
