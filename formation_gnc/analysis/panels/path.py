"""Path in the orbital plane."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import DeputyPanel
from formation_gnc.analysis.plot import AXIS_COLOURS, RED, Axis, Curve, Plot, Style

BLUE = AXIS_COLOURS[0]


def plots(deputy: DeputyHistory) -> list[Plot]:
    """Radial over along-track, with the target; the direction of flight is to the left."""
    truth, target = deputy.truth, deputy.target
    curves = [
        Curve("true path", truth[:, 1], truth[:, 0], Style(BLUE, width=1.2)),
        Curve("target", target[:, 1], target[:, 0], Style(RED, "dashed")),
        Curve("start", truth[:1, 1], truth[:1, 0], Style(BLUE, "none", marker="dot", size=5.0)),
        Curve("target at the end", target[-1:, 1], target[-1:, 0], Style(RED, "none", marker="star", size=12.0)),
    ]
    title = f"{deputy.name}: path in the chief's Hill frame"
    return [Plot(title, Axis("along-track y", "m", reversed=True), Axis("radial x", "m"), curves, equal=True)]


PATH = DeputyPanel("path", plots, "path in the orbital plane")
