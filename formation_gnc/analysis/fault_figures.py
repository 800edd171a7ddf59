"""Faults of a recorded run in words, as the summary of a flight has them."""

from formation_gnc.analysis.deputy_history import HOUR
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.supervision_history import Span

LINES = 20
"""Lines of each kind at most."""


def fault_figures(run: RunHistory) -> dict[str, dict[str, list[str]]]:
    """By deputy: its modes one after the other, and the faults injected, detected and answered, with times in s."""
    return {
        name: {
            "modes": _first([f"{span.name} from {span.begin:g} s" for span in deputy.supervision.modes]),
            "injected": _first([f"at {mark.time * HOUR:.6g} s: {mark.detail}" for mark in deputy.supervision.injected]),
            "detected": _first(list(map(_words, deputy.supervision.detections))),
            "answered": _first(list(map(_words, deputy.supervision.responses))),
        }
        for name, deputy in run.deputies.items()
    }


def _words(span: Span) -> str:
    reason = f", for {span.reason}" if span.reason else ""
    return f"from {span.begin:g} to {span.end:g} s: {span.name}{reason}"


def _first(lines: list[str]) -> list[str]:
    more = len(lines) - LINES
    return [*lines[:LINES], f"and {more} more"] if more > 0 else lines
