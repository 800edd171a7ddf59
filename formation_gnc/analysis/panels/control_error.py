"""Control error: true position minus target."""

import numpy as np

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import HISTORY, DeputyPanel
from formation_gnc.analysis.plot import AXIS_COLOURS, BLACK, HILL_AXES, TIME, Axis, Curve, Plot, Style


def magnitude(deputy: DeputyHistory) -> list[Plot]:
    """Magnitudes by axis and distance, logarithmic down to a thousandth of the largest distance."""
    time, error = deputy.control_time, deputy.control_error[:, :3]
    distance = np.linalg.norm(error, axis=1)
    curves = [
        Curve(label, time, np.abs(error[:, axis]), Style(colour, width=0.7))
        for axis, (label, colour) in enumerate(zip(HILL_AXES, AXIS_COLOURS, strict=True))
    ]
    curves.append(Curve("distance", time, distance, Style(BLACK, width=1.5)))
    limit = max(1e-3 * float(distance.max(initial=0.0)), 1e-9)
    y = Axis("|truth - target|", "m", log=True, lower_limit=limit)
    return [Plot("control error", TIME, y, curves)]


def by_axis(deputy: DeputyHistory) -> list[Plot]:
    """Signed components."""
    curves = [
        Curve(label, deputy.control_time, deputy.control_error[:, axis], Style(colour))
        for axis, (label, colour) in enumerate(zip(HILL_AXES, AXIS_COLOURS, strict=True))
    ]
    return [Plot("control error by axis", TIME, Axis("truth - target", "m"), curves)]


CONTROL_ERROR = DeputyPanel("control", magnitude, HISTORY)
CONTROL_ERROR_BY_AXIS = DeputyPanel("control_by_axis", by_axis, HISTORY, in_overview=False)
