"""A campaign's results as one self-contained HTML page, and its pictures."""

import shlex
from collections.abc import Iterator, Sequence
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from formation_gnc.analysis.overview import draw_column
from formation_gnc.analysis.page import section, side_by_side, table, table_of, write_page
from formation_gnc.analysis.plot import Plot
from formation_gnc.analysis.plotly_renderer import draw_columns
from formation_gnc.analysis.timeline import Timeline
from formation_gnc.campaign.case import CASE, REASON, VARIANT
from formation_gnc.campaign.dataset import TIMING
from formation_gnc.campaign.definition import NOMINAL
from formation_gnc.campaign.evaluation import Difference, Flights, Outcome, correlations, differences
from formation_gnc.campaign.order_statistics import Verdict
from formation_gnc.campaign.plots import distribution, errors_over_time, interval_plot, scatters
from formation_gnc.campaign.requirement import Requirement

STRONGEST = 12
"""Rank correlations listed for a figure."""

DRAWN = 4
"""Of them, those that are drawn."""

WORST = 5
"""Worst cases listed for a requirement in a configuration."""

OVER_TIME = 8
"""Configurations whose errors over time are drawn, at most."""

FAILED = 100
"""Cases that raised, listed at most."""

_CLASSES = {Verdict.MET: "met", Verdict.NOT_MET: "missed", Verdict.NOT_ENOUGH_RUNS: "open"}


def number(value: float | None) -> str:
    """A figure for people; a dash for none."""
    return "-" if value is None or not isfinite(value) else f"{value:.4g}"


def outcome_row(outcome: Outcome) -> list[str]:
    """Cells of a verdict, below `OUTCOME_HEAD`."""
    allowed = "-" if outcome.allowed < 0 else str(outcome.allowed)
    if outcome.needed is None:
        failures, allowed, needed = "-", "-", "-"
    else:
        failures, needed = f"{outcome.failures} of {outcome.runs}", str(outcome.needed)
    return [
        outcome.requirement,
        outcome.configuration,
        str(outcome.verdict),
        failures,
        allowed,
        needed,
        number(outcome.bound),
        number(outcome.margin),
    ]


OUTCOME_HEAD = ("requirement", "configuration", "verdict", "failures", "allowed", "runs needed", "bound", "margin")


def command_of(flights: Flights, case: int, configuration: str) -> str:
    """Command that flies a case again."""
    words = ["formation-gnc", "campaign", flights.campaign.name, "--only", str(case)]
    if configuration != NOMINAL:
        words += ["--variant", configuration]
    return shlex.join(
        [*words, "--out", str(flights.results.directory), "--bag", f"bags/{flights.campaign.name}_{case}"]
    )


def failed_cases(flights: Flights) -> list[tuple[int, str, str]]:
    """Case, configuration and reason of every flight that raised."""
    found = flights.results.table([REASON], runs=flights.campaign.runs)
    rows = zip(found[CASE].to_pylist(), found[VARIANT].to_pylist(), found[REASON].to_pylist(), strict=True)
    return [row for row in rows if row[2]]


def write_report(flights: Flights, outcomes: Sequence[Outcome], path: Path) -> Path:
    """Write the page and, beside it in `pictures/`, what it shows as PNG; returns the path of the page."""
    pictures = path.parent / "pictures"
    pictures.mkdir(exist_ok=True)
    sections, drawn = [f"<h2>Summary</h2>{table(_summary(flights))}", _verdicts(outcomes)], 0
    for heading, below, plots in _parts(flights):
        if any(len(curve.x) for plot in plots for curve in plot.curves):
            drawn += 1
            sections.append(_drawn(heading, plots) + below)
            draw_column(plots, pictures / f"{drawn:02d}_{_file_name(heading)}.png")
    sections += [_differences(flights), _worst(flights), _failed(flights)]
    return write_page(path, f"Campaign {flights.campaign.name}", sections)


def _drawn(heading: str, plots: Sequence[Plot]) -> str:
    """Plots over time in one figure; all others in one each, side by side where there is room."""
    if all(plot.over_time for plot in plots) or len(plots) == 1:
        return section(heading, draw_columns([plots], Timeline((), (), {})))
    figures = (section(plot.title, draw_columns([[plot]], Timeline((), (), {}))) for plot in plots)
    return f"<h2>{escape(heading)}</h2>{side_by_side(figures)}"


def _file_name(heading: str) -> str:
    return "".join(each if each.isalnum() else "_" for each in heading.lower())[:60].strip("_")


def _summary(flights: Flights) -> dict[str, Any]:
    campaign, manifest = flights.campaign, flights.results.manifest
    wall = [each for each in flights.results.table(["wall_time_s"], TIMING)["wall_time_s"].to_pylist() if each]
    rows: dict[str, Any] = {
        "scenario": ", ".join(each.stem for each in campaign.scenarios),
        "cases": campaign.runs,
        "configurations": ", ".join(each.name for each in campaign.configurations),
        "seed": campaign.seed,
        "dispersions": ", ".join(each.name for each in campaign.dispersions) or "none",
        "faults": ", ".join(each.name for each in campaign.faults) or "none",
        "flights that raised": len(failed_cases(flights)),
        "version": f"{manifest['version']}, commit {manifest['commit']}",
    }
    if wall:
        rows["wall time of a flight"] = f"{np.median(wall):.2f} s median, {sum(wall) / 3600.0:.2f} h all together"
    return rows


def _verdicts(outcomes: Sequence[Outcome]) -> str:
    several = len({each.configuration for each in outcomes}) > 1
    shown = [number for number, name in enumerate(OUTCOME_HEAD) if several or name != "configuration"]
    head = "".join(f"<th>{escape(OUTCOME_HEAD[number])}</th>" for number in shown)
    rows = ""
    for outcome in outcomes:
        row = outcome_row(outcome)
        cells = "".join(f"<td>{escape(row[number])}</td>" for number in shown)
        rows += f"<tr class='{_CLASSES[outcome.verdict]}'>{cells}</tr>"
    explained = (
        "<p>Bound: what the required share of all flights keeps with the confidence, by order statistics; for a mean, "
        "the mean. Margin: from there to the limit. Runs needed: with which the requirement is met if no more fail.</p>"
    )
    return f"<h2>Verdicts</h2><table class='rows'><tr>{head}</tr>{rows}</table>{explained}" if outcomes else ""


def _figures_of(flights: Flights) -> list[Requirement]:
    """A requirement for each figure of numbers that is asked for."""
    return list({each.figure: each for each in flights.campaign.requirements if not each.of_mean}.values())


def _parts(flights: Flights) -> Iterator[tuple[str, str, list[Plot]]]:
    """Heading, what is below the plots, and the plots."""
    asked, campaign = _figures_of(flights), flights.campaign
    plots = [distribution(flights, each) for each in asked]
    if plots:
        yield "Distributions", "<p>Share of the flights below a value; dotted, its 95 % band.</p>", plots
    for configuration in campaign.configurations[:OVER_TIME]:
        for deputy in flights.deputies[configuration.name]:
            words = f"Error over time: {deputy}" + ("" if configuration.name == NOMINAL else f", {configuration.name}")
            yield words, "", errors_over_time(flights, configuration.name, deputy)
    first = campaign.configurations[0].name
    for requirement in asked:
        found = correlations(flights, requirement.figure, first, not requirement.relation.startswith(">"))
        rows = [(each.words, f"{each.rank:+.3f}", f"{each.chance:.2g}") for each in found[:STRONGEST]]
        listed = table_of(("drawn value", "rank correlation", "probability by chance"), rows)
        words = f"What hurts: {requirement.figure}" + ("" if first == NOMINAL else f", {first}")
        yield words, listed, scatters(flights, requirement, first, found[:DRAWN])
    for requirement in asked:
        pairs = differences(flights, requirement.figure, not requirement.relation.startswith(">"))
        if pairs:
            yield f"Paired: {requirement.figure}", "", [_interval_plot(pairs)]


def _interval_plot(pairs: Sequence[Difference]) -> Plot:
    mean, low, high = (np.array([getattr(each, name) for each in pairs]) for name in ("mean", "low", "high"))
    names = [each.configuration for each in pairs]
    return interval_plot(names, mean, low, high, pairs[0].figure, pairs[0].reference)


def _differences(flights: Flights) -> str:
    rows = [
        (
            each.figure,
            f"{each.configuration} - {each.reference}",
            number(each.mean),
            f"{number(each.low)} to {number(each.high)}",
            f"{100.0 * each.better:.1f} %",
            each.cases,
        )
        for requirement in _figures_of(flights)
        for each in differences(flights, requirement.figure, not requirement.relation.startswith(">"))
    ]
    if not rows:
        return ""
    head = ("figure", "pair", "mean difference", "95 % confidence", "less in", "cases")
    return f"<h2>Variants paired on the same cases</h2>{table_of(head, rows)}"


def _worst(flights: Flights) -> str:
    rows, several = list[tuple[Any, ...]](), len(flights.campaign.configurations) > 1
    for requirement in _figures_of(flights):
        upper = not requirement.relation.startswith(">")
        for configuration in flights.campaign.configurations:
            figure = flights.figure(requirement.figure, configuration.name, upper)
            bad = np.where(np.isnan(figure.values), np.inf, figure.values if upper else -figure.values)
            for row in np.argsort(-bad, kind="stable")[:WORST]:
                case = int(figure.cases[row])
                shown = number(float(figure.values[row])) if not figure.reasons[row] else figure.reasons[row]
                again = command_of(flights, case, configuration.name)
                rows.append((requirement.figure, *([configuration.name] if several else []), case, shown, again))
    if not rows:
        return ""
    head = ("figure", *(["configuration"] if several else []), "case", "value", "flown again by")
    return f"<h2>Worst cases</h2>{table_of(head, rows)}"


def _failed(flights: Flights) -> str:
    failed = failed_cases(flights)
    if not failed:
        return ""
    more = f"<p>and {len(failed) - FAILED} more</p>" if len(failed) > FAILED else ""
    return f"<h2>Flights that raised</h2>{table_of(('case', 'configuration', 'reason'), failed[:FAILED])}{more}"
