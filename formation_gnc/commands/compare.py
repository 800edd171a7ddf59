"""Compare recorded runs: their figures side by side, and whether they are identical bit for bit.

Differences are against the first bag. Runs are identical when every message of every GNC topic is; topics of
wall time do not count. A bag with several runs counts as so many bags.
"""

import argparse
import json
import os
import string
from pathlib import Path

from rich.console import Console

from formation_gnc.analysis.compare import draw_comparison, gnc_topics, run_figures
from formation_gnc.analysis.figure_table import FIGURES, RUN_FIGURES
from formation_gnc.commands.reading import print_remarks, runs_of
from formation_gnc.commands.tables import print_table
from formation_gnc.errors import ConfigurationError
from formation_gnc.recording import Difference, identical

RunFigures = dict[str, dict[str, float | str | None]]
"""Figures by name, by deputy; of the run as a whole by ""."""

IDENTICAL = "identical on every GNC topic"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bags", metavar="bag", nargs="+", type=Path, help="two or more bags")
    parser.add_argument("--plot", metavar="FILE", type=Path, help="plot errors and delta-v: .png, .pdf or .svg")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Compare, plot and print."""
    if len(options.bags) < 2:
        raise ConfigurationError("compare: one bag is not allowed; it must be two or more")
    if options.plot is not None and options.plot.suffix not in (".png", ".pdf", ".svg"):
        raise ConfigurationError(f"plot {options.plot}: is not allowed; it must be a .png, .pdf or .svg file")
    bags = [run for path in options.bags for run in runs_of(path)]
    labels = [run.path for run in bags]
    figures = [run_figures(bag) for bag in bags]
    differences = [identical(bags[0], other, gnc_topics(bags[0], other)) for other in bags[1:]]
    if options.plot is not None:
        try:
            draw_comparison(bags, _short(labels), options.plot)
        except OSError as error:
            raise ConfigurationError(f"plot {options.plot}: {error.strerror or error}") from None
    if options.json:
        remarks = {str(bag.path): bag.remarks for bag in bags if bag.remarks}
        print(json.dumps(_summary(labels, figures, differences) | {"remarks": remarks}, indent=2))
    else:
        print_remarks(bags)
        _print(labels, figures, differences)
    return 0


def _summary(paths: list[Path], figures: list[RunFigures], differences: list[list[Difference]]) -> dict[str, object]:
    first = figures[0]
    return {
        "bags": [{"bag": str(path), "figures": each} for path, each in zip(paths, figures, strict=True)],
        "differences": [
            {
                "bag": str(path),
                "identical": not found,
                "first_by_topic": [str(difference) for difference in found],
                "figures": {
                    part: {
                        name: value - other
                        for name, value in values.items()
                        if not isinstance(value, str | None) and not isinstance(other := first[part][name], str | None)
                    }
                    for part, values in each.items()
                    if part in first
                },
            }
            for path, each, found in zip(paths[1:], figures[1:], differences, strict=True)
        ],
    }


def _letters(paths: list[Path]) -> list[str]:
    """A letter for each bag; numbers where there are more than letters."""
    letters = string.ascii_uppercase
    return list(letters[: len(paths)]) if len(paths) <= len(letters) else list(map(str, range(len(paths))))


def _short(paths: list[Path]) -> list[str]:
    """Letter and path of each bag from where the paths part, for a legend."""
    common = Path(os.path.commonpath([path.absolute().parent for path in paths]))
    return [
        f"{letter}: {path.absolute().relative_to(common)}" for letter, path in zip(_letters(paths), paths, strict=True)
    ]


def _print(paths: list[Path], figures: list[RunFigures], differences: list[list[Difference]]) -> None:
    console = Console(highlight=False)
    letters = _letters(paths)
    for letter, path in zip(letters, paths, strict=True):
        console.print(f"{letter}: {path}", soft_wrap=True, markup=False)
    labels: list[str] = []
    values: list[list[str]] = [[] for _ in paths]
    deltas: list[list[str]] = [[] for _ in paths[1:]]
    for deputy in dict.fromkeys(name for each in figures for name in each):
        for figure in FIGURES if deputy else RUN_FIGURES:
            row = [each.get(deputy, {}).get(figure.name) for each in figures]
            labels.append(f"{deputy} {figure.label}".strip())
            for column, value in zip(values, row, strict=True):
                column.append(figure.text(value))
            for column, value in zip(deltas, row[1:], strict=True):
                column.append(figure.difference(value, row[0]))
    columns = [[letter, *column] for letter, column in zip(letters, values, strict=True)]
    columns += [[f"{letter} - {letters[0]}", *column] for letter, column in zip(letters[1:], deltas, strict=True)]
    print_table(console, [["figure", *labels], *columns])
    for path, found in zip(paths[1:], differences, strict=True):
        print(f"{path}: {IDENTICAL}" if not found else f"{path}: differs from {paths[0]}, first of each topic:")
        for difference in found:
            print(f"  {difference}")
