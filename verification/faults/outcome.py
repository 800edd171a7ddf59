"""What came of a fault without and with supervision: a row of the table that is kept."""

import csv
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from math import inf, isfinite
from pathlib import Path
from typing import Any, Self

from formation_gnc.mode_records import Mode
from verification.faults.flights import FORMATIONS, Flight
from verification.faults.injected import FAULTS, Fault

KEPT = Path(__file__).with_name("flown.csv")

HARM, HELD = 20.0, 5.0
"""Errors from which a fault does harm, and up to which a formation is kept, m."""


@dataclass(frozen=True)
class Outcome:
    """A fault with and without supervision; lengths in m, velocities in m/s, times in s."""

    formation: str
    law: str
    tick: float
    fault: str
    bare_error: float
    """Largest without supervision, as the following two are."""
    bare_nearest: float
    bare_delta_v: float
    planned: float
    """Least distance of the targets."""
    found_by: str
    """Monitor and subject that failed first; empty for none."""
    is_named: bool
    """Whether one of those that failed names the part that is at fault."""
    delay: float
    """Ticks to the first failure; infinite for none."""
    error_before: float
    """Largest error up to then."""
    answers: str
    mode: str
    """At the end."""
    error: float
    """Largest."""
    final_error: float
    nearest: float
    coasting: float
    """Least distance over a day of coasting; infinite where the flight ends in `keep`."""
    delta_v: float

    @classmethod
    def of(cls, formation: str, law: str, fault: Fault, bare: Flight, flown: Flight) -> Self:
        """Of the flight without supervision, and that with it."""
        delay = flown.delay
        return cls(
            formation,
            law,
            flown.tick,
            fault.words,
            max(bare.error),
            bare.nearest,
            bare.delta_v,
            bare.planned,
            flown.first,
            any(subject in fault.subjects for _, subject in flown.found),
            inf if delay is None else delay,
            max(flown.error[: len(flown.error) if delay is None else delay + 1]),
            ", ".join(flown.answers),
            flown.mode,
            max(flown.error),
            flown.error[-1],
            flown.nearest,
            flown.coasting,
            flown.delta_v,
        )

    @property
    def is_harmful(self) -> bool:
        """Whether the fault does harm without supervision."""
        return self.bare_error > HARM or self.bare_nearest < 0.5 * self.planned

    @property
    def end(self) -> str:
        """How the flight with supervision ends; empty for neither kept nor safe."""
        if self.mode == Mode.KEEP and self.final_error <= HELD:
            return "kept"
        return "safe" if self.mode != Mode.KEEP and self.coasting > FORMATIONS[self.formation].limit else ""

    @property
    def is_late(self) -> bool:
        """Whether a harmful fault is found after half of its harm, or not."""
        return self.is_harmful and (not self.found_by or self.error_before > 0.5 * self.bare_error)

    @property
    def verdict(self) -> str:
        """What became of it, or what is missing."""
        if not self.is_harmful:
            if self.end:
                return f"no harm, {self.end}"
            return "no harm" if self.error <= self.bare_error else "**NO**: harm by the answer"
        if not self.found_by:
            return "**NO**: not found"
        if not self.end:
            return f"**NO**: ends in {self.mode}, {self.final_error:.3g} m off"
        return f"**NO**: found late, {self.end}" if self.is_late else self.end

    @property
    def falls_short(self) -> bool:
        """Whether something is missing."""
        return self.verdict.startswith("**NO**")

    @property
    def short_words(self) -> str:
        """Cell of the table of all laws."""
        return f"{self.bare_error:.3g}, {self.error:.3g}, {self.verdict}"

    @property
    def line(self) -> str:
        """Line of a Markdown table."""
        is_found = isfinite(self.delay)
        cells = [
            self.fault,
            f"{self.bare_error:.3g}",
            f"{self.bare_nearest:.3g}",
            f"{self.bare_delta_v:.3g}",
            (self.found_by or "none") + ("" if self.is_named or not is_found else ", wrongly"),
            f"{self.delay:g}" if is_found else "",
            self.answers or "none",
            self.mode,
            f"{self.error:.3g}",
            f"{self.final_error:.3g}",
            f"{self.nearest:.3g}",
            f"{self.coasting:.3g}" if isfinite(self.coasting) else "",
            f"{self.delta_v:.3g}",
            self.verdict,
        ]
        return "| " + " | ".join(cells) + " |"


def kept() -> list[Outcome]:
    """What is kept, in the order of formations, laws and faults."""
    if not KEPT.exists():
        return []
    with KEPT.open() as stream:
        return [
            Outcome(**{each.name: _read(each.type, row[each.name]) for each in fields(Outcome)})
            for row in csv.DictReader(stream)
        ]


def _read(kind: Any, text: str) -> Any:
    return text == "True" if kind is bool else kind(text)


def keep(outcomes: Iterable[Outcome]) -> None:
    """Keep outcomes, in place of earlier ones of the same flights."""
    rows = {(each.formation, each.law, each.tick, each.fault): each for each in (*kept(), *outcomes)}
    formations, faults = list(FORMATIONS), [each.words for each in FAULTS]
    order = sorted(rows, key=lambda key: (formations.index(key[0]), key[1], key[2], faults.index(key[3])))
    with KEPT.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([each.name for each in fields(Outcome)])
        for key in order:
            writer.writerow([f"{value:.6g}" if isinstance(value, float) else value for value in astuple(rows[key])])
