"""Acceleration by thrust, and delta-v."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import AXIS_COLOURS, GREY, HILL_AXES, TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """Acceleration by thrust, and the delta-v so far on the right."""
    curves = [
        Curve(label, deputy.time, 1e6 * deputy.acceleration[:, axis], Style(colour, width=0.9))
        for axis, (label, colour) in enumerate(zip(HILL_AXES, AXIS_COLOURS, strict=True))
    ]
    curves.append(Curve("delta-v", deputy.time, 1e3 * deputy.delta_v, Style(GREY, width=1.5), right=True))
    return [
        Plot(
            "acceleration by thrust, and delta-v", TIME, Axis("acceleration", "µm/s²"), curves, Axis("delta-v", "mm/s")
        )
    ]


THRUST = DeputyPanel("thrust", plots, HISTORY)
