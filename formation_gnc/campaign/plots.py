"""Plots of a campaign: distributions with their confidence bands, errors over time, draws against figures."""

from collections.abc import Sequence
from math import isfinite, log, sqrt

import numpy as np

from formation_gnc.analysis.plot import AXIS_COLOURS, COLOURS, GREY, HILL_AXES, RED, TIME, Axis, Curve, Plot, Style
from formation_gnc.campaign.case import nominal_scenario
from formation_gnc.campaign.dataset import ERRORS
from formation_gnc.campaign.evaluation import Correlation, Flights
from formation_gnc.campaign.flight_figures import curve_ticks
from formation_gnc.campaign.requirement import Requirement
from formation_gnc.types import AXES, Vector

CONFIDENCE = 0.95
"""Of the band about a distribution (Dvoretzky, Kiefer, Wolfowitz; Massart)."""

POINTS = 400
"""Points of a distribution at most."""

PERCENTILES = {50.0: "solid", 95.0: "dashed", 99.73: "dotted"}

CURVES = 10_000
"""Flights whose errors over time are read, at most."""

SCATTERED = 4_000
"""Points of a scatter at most."""


def distribution(flights: Flights, requirement: Requirement) -> Plot:
    """Distribution of a requirement's figure in all configurations, its band and the limit."""
    upper = not requirement.relation.startswith(">")
    curves = []
    for number, configuration in enumerate(flights.campaign.configurations):
        values = flights.figure(requirement.figure, configuration.name, upper).values
        count, ordered = len(values), np.sort(values[np.isfinite(values)])
        if not len(ordered):
            continue
        rows = np.unique(np.linspace(0, len(ordered) - 1, min(len(ordered), POINTS)).round().astype(int))
        share = 100.0 * (rows + 1) / count
        half = 100.0 * sqrt(log(2.0 / (1.0 - CONFIDENCE)) / (2.0 * count))
        style = Style(COLOURS[number % len(COLOURS)], width=1.4)
        edge = Style(style.colour, line="dotted", width=0.7)
        curves.append(Curve(configuration.name, ordered[rows], share, style))
        for bound in (np.clip(share - half, 0.0, 100.0), np.clip(share + half, 0.0, 100.0)):
            curves.append(Curve(configuration.name, ordered[rows], bound, edge))
    if isfinite(requirement.limit):
        limit = np.full(2, requirement.limit)
        curves.append(Curve("limit", limit, np.array([0.0, 100.0]), Style(RED, line="dashed")))
    return Plot(requirement.text, Axis(requirement.figure), Axis("flights below", "%"), curves)


def errors_over_time(flights: Flights, configuration: str, deputy: str) -> list[Plot]:
    """Percentiles over all flights of the size of the position error, one plot for each Hill axis."""
    names = ["deputy", *AXES]
    found = flights.results.table(names, ERRORS, min(flights.campaign.runs, CURVES), configuration)
    rows = [number for number, name in enumerate(found["deputy"].to_pylist()) if name == deputy]
    meant = next(each for each in flights.campaign.configurations if each.name == configuration)
    plant = nominal_scenario(flights.campaign, meant).plant
    time = curve_ticks(plant.ticks) * plant.tick / 3600.0
    plots = []
    for number, axis in enumerate(AXES):
        flown = [found[axis][row].as_py() for row in rows]
        errors = np.abs(np.array([each for each in flown if len(each) == len(time)], dtype=float))
        curves = [
            Curve(f"{percent:g} %", time, _percentile(errors, percent), Style(AXIS_COLOURS[number], line=line))  # type: ignore[arg-type]
            for percent, line in PERCENTILES.items()
            if len(errors)
        ]
        plots.append(Plot(f"{deputy}, {HILL_AXES[number]}", TIME, Axis(f"|error| {HILL_AXES[number]}", "m"), curves))
    return plots


def _percentile(errors: Vector, percent: float) -> Vector:
    """Value that so many per cent of the flights are at or below, at each time; a flight without one is the worst."""
    ordered = np.sort(np.where(np.isnan(errors), np.inf, errors), axis=0)
    row = min(int(np.ceil(percent / 100.0 * len(ordered))), len(ordered)) - 1
    found = ordered[max(row, 0)]
    return np.where(np.isfinite(found), found, np.nan)


def scatters(
    flights: Flights, requirement: Requirement, configuration: str, found: Sequence[Correlation]
) -> list[Plot]:
    """Drawn values against a figure."""
    upper = not requirement.relation.startswith(">")
    figure = flights.figure(requirement.figure, configuration, upper).values
    plots = []
    for each in found:
        drawn = flights.column(each.drawn, configuration).values
        good = np.flatnonzero(np.isfinite(drawn) & np.isfinite(figure))[:SCATTERED]
        points = Style(AXIS_COLOURS[0], line="none", marker="dot", size=2.5)
        curves = [Curve(configuration, drawn[good], figure[good], points)]
        if isfinite(requirement.limit) and len(good):
            ends = np.array([drawn[good].min(), drawn[good].max()])
            curves.append(Curve("limit", ends, np.full(2, requirement.limit), Style(RED, line="dashed")))
        title = f"{each.words}, rank correlation {each.rank:+.2f}"
        plots.append(Plot(title, Axis(each.drawn), Axis(requirement.figure), curves))
    return plots


def interval_plot(names: Sequence[str], means: Vector, low: Vector, high: Vector, figure: str, reference: str) -> Plot:
    """Paired differences with their intervals, one below the other."""
    curves = []
    for row, name in enumerate(names):
        colour = COLOURS[(row + 1) % len(COLOURS)]
        height = np.full(2, float(-row))
        curves.append(Curve(name, np.array([low[row], high[row]]), height, Style(colour, width=2.0)))
        point = Style(colour, line="none", marker="diamond", size=6.0)
        curves.append(Curve(name, means[row : row + 1], height[:1], point))
    span = np.array([-float(max(len(names) - 1, 0)) - 0.5, 0.5])
    curves.append(Curve("no difference", np.zeros(2), span, Style(GREY, line="dashed")))
    return Plot(f"difference to {reference}", Axis(f"{figure}, difference to {reference}"), Axis("variant"), curves)
