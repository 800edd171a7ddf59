"""A figure with its tolerance, and a plot: what every page of the verification is made of."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure as Drawing

mpl.use("Agg")
import matplotlib.pyplot as plt


@dataclass(frozen=True)
class Figure:
    """A published or required figure beside ours."""

    name: str
    printed: str
    ours: float
    unit: str
    least: float
    greatest: float

    @property
    def holds(self) -> bool:
        """Whether ours lies within its tolerance."""
        return self.least <= self.ours <= self.greatest

    @property
    def row(self) -> str:
        """Line of a Markdown table."""
        verdict = "yes" if self.holds else "**NO**"
        return (
            f"| {self.name} | {self.printed} | {self.ours:.4g} {self.unit} | "
            f"{self.least:g} to {self.greatest:g} {self.unit} | {verdict} |"
        )


class Cell(Figure):
    """A figure of ours that stands in a table of its own: a page lists it when it is off, and only then."""


TABLE = "| figure | printed | ours | stated tolerance | holds |\n|---|---|---|---|---|"


def failures(figures: Sequence[Figure]) -> int:
    """How many figures are outside their tolerance; each is named on standard error."""
    failed = [figure for figure in figures if not figure.holds]
    for figure in failed:
        print(f"outside its tolerance: {figure.row}", file=sys.stderr)
    return len(failed)


def save(plot: Drawing, path: Path) -> None:
    """Write a plot without anything that changes from one run to the next."""
    for panel in plot.axes:
        panel.grid(alpha=0.3)
    plot.tight_layout()
    plot.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(plot)
