"""Every figure of ours on the page of the seeds, held to the one that was accepted last."""

import csv
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from verification.figure import Cell, Figure
from verification.seeds.cases import STATES, Array, in_joshis_order

ACCEPTED = Path(__file__).with_name("accepted.csv")

RELATIVE = 1e-3
"""What the page shows of a figure: far above what another machine's arithmetic changes, and far below what a
change of a law or of a model does."""

NOISE = np.repeat([1e-5, 1e-8], 3)
"""Of state errors besides, m and m/s: errors of this size are those of the arithmetic."""


class Ours:
    """Puts figures of ours into words for the page, and holds each to the one that was accepted last."""

    def __init__(self) -> None:
        """With none yet."""
        self.cells: list[Cell] = []

    def __call__(self, name: str, value: float, form: str = ".4g", unit: str = "", margin: float | None = None) -> str:
        """The figure in a form; it may be off by the margin, or else by its share of `RELATIVE`."""
        before = accepted().get(name, float("nan"))
        margin = RELATIVE * abs(before) if margin is None else margin
        self.cells.append(Cell(name, f"{before:.4g}", value, unit, before - margin, before + margin))
        return f"{value:{form}}"

    def state(self, name: str, error: Array) -> list[str]:
        """An error (6,), SI, in Joshi's order and units; `RELATIVE` is of position's or velocity's length."""
        lengths = np.repeat([np.linalg.norm(error[:3]), np.linalg.norm(error[3:])], 3)
        values, margins = in_joshis_order(error), in_joshis_order(RELATIVE * lengths + NOISE)
        units = ("km", "km/s") * 3
        return [
            self(f"{name}: {label}", value, ".3g", unit, margin)
            for label, value, unit, margin in zip(STATES, values, units, margins, strict=True)
        ]


def joined(directory: Path, *parts: Callable[[Path, Ours], tuple[str, list[Figure]]]) -> tuple[str, list[Figure]]:
    """Parts of a page one after the other, with their figures and those of ours."""
    ours, texts, figures = Ours(), list[str](), list[Figure]()
    for part in parts:
        text, more = part(directory, ours)
        texts.append(text)
        figures += more
    return "\n".join(texts), [*figures, *ours.cells]


@cache
def accepted() -> dict[str, float]:
    """The figures accepted last, by name."""
    return {name: float(value) for _, name, value in rows()}


def rows() -> list[list[str]]:
    """Part of the page, name and value of each figure accepted last."""
    if not ACCEPTED.exists():
        return []
    with ACCEPTED.open() as stream:
        return list(csv.reader(stream))[1:]


def accept(part: str, cells: list[Cell]) -> None:
    """Take these for the figures of a part of the page from now on."""
    mine = [[part, cell.name, f"{cell.ours:.9g}"] for cell in cells]
    others = [row for row in rows() if row[0] != part]
    with ACCEPTED.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["part", "figure", "ours"])
        writer.writerows(sorted(others + mine, key=lambda row: row[0]))
