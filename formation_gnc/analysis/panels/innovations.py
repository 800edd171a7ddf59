"""Innovations of the filter with its standard deviations."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import MEASUREMENTS, DeputyPanel
from formation_gnc.analysis.panels.sensors import components, innovation_unit, sensor_colours, title
from formation_gnc.analysis.plot import GREY, TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """A plot for each sensor that has readings or innovations, with 3-sigma bounds."""
    result = []
    for sensor, colour in sensor_colours(deputy).items():
        unit, curves = innovation_unit(sensor), []
        for label, rows in components(deputy.innovations, sensor).items():
            time, innovation, sigma = (rows * [1.0, unit.factor, unit.factor]).T
            curves.append(Curve(label, time, innovation, Style(colour, "none", marker="dot")))
            curves += [Curve("3σ", time, sign * sigma, Style(GREY, "dotted")) for sign in (-3.0, 3.0)]
        result.append(Plot(f"innovation of {title(sensor)}", TIME, Axis("innovation", unit.name), curves))
    return result


INNOVATIONS = DeputyPanel("innovations", plots, MEASUREMENTS, column=1, in_overview=False)
