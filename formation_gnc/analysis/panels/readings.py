"""Readings of the sensors."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import MEASUREMENTS, DeputyPanel
from formation_gnc.analysis.panels.sensors import components, reading_unit, sensor_colours, title
from formation_gnc.analysis.plot import TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """A plot for each sensor that has readings or innovations."""
    result = []
    for sensor, colour in sensor_colours(deputy).items():
        unit = reading_unit(sensor)
        curves = [
            Curve(label, rows[:, 0], unit.factor * rows[:, 1], Style(colour, "none", marker="dot"))
            for label, rows in components(deputy.readings, sensor).items()
        ]
        result.append(Plot(title(sensor), TIME, Axis(title(sensor), unit.name), curves))
    return result


READINGS = DeputyPanel("readings", plots, MEASUREMENTS, in_overview=False)
