"""Innovations of the filter with its standard deviations."""

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.panels.panel import MEASUREMENTS, DeputyPanel
from formation_gnc.analysis.panels.sensors import components, sensor_colours, sensor_words
from formation_gnc.analysis.plot import GREY, TIME, Axis, Curve, Plot, Style


def plots(deputy: DeputyHistory) -> list[Plot]:
    """A plot for each sensor that has readings or innovations, with 3-sigma bounds."""
    result = []
    for sensor, colour in sensor_colours(deputy).items():
        words, curves = sensor_words(sensor), []
        for label, rows in components(deputy.innovations, sensor).items():
            time, innovation, sigma = (rows * [1.0, words.innovation_scale, words.innovation_scale]).T
            curves.append(Curve(label, time, innovation, Style(colour, "none", marker="dot")))
            curves += [Curve("3σ", time, sign * sigma, Style(GREY, "dotted")) for sign in (-3.0, 3.0)]
        title = f"innovation of {sensor.replace('_', ' ')}"
        result.append(Plot(title, TIME, Axis("innovation", words.innovation_unit), curves))
    return result


INNOVATIONS = DeputyPanel("innovations", plots, MEASUREMENTS, column=1, in_overview=False)
