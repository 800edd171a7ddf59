"""What a number of flights shows of all flights, without any assumption on how a figure is distributed.

With n flights that are independent, the number of failures is binomial. A requirement of share p at confidence c is
met when a system that meets it in just a share p of flights would have as few failures with a probability of at most
1 - c; it is not met when such a system would have as many failures with at most that probability. In between there
are not enough runs (Wilks; the one-sided tolerance limit by order statistics).
"""

from enum import StrEnum
from math import inf

import numpy as np
from scipy.special import bdtr, bdtrc

from formation_gnc.types import Vector


class Verdict(StrEnum):
    """What the flights show."""

    MET = "met"
    NOT_MET = "not met"
    NOT_ENOUGH_RUNS = "not enough runs"


def allowed_failures(runs: int, share: float, confidence: float) -> int:
    """Most failures of so many flights with which a requirement is met; -1 where even none is too many.

    Args:
        runs: flights.
        share: of all flights that are to succeed.
        confidence: that they do.
    """
    low, high = -1, runs  # bisection: the distribution function grows with the number of failures
    while high - low > 1:
        middle = (low + high) // 2
        if bdtr(middle, runs, 1.0 - share) <= 1.0 - confidence:
            low = middle
        else:
            high = middle
    return low


def runs_needed(failures: int, share: float, confidence: float) -> int:
    """Least number of flights with which a requirement is met in spite of so many failures."""
    high = failures + 1
    while allowed_failures(high, share, confidence) < failures:
        high *= 2
    low = failures
    while high - low > 1:
        middle = (low + high) // 2
        if allowed_failures(middle, share, confidence) < failures:
            low = middle
        else:
            high = middle
    return high


def verdict(failures: int, runs: int, share: float, confidence: float) -> Verdict:
    """What so many failures of so many flights show."""
    if runs and failures <= allowed_failures(runs, share, confidence):
        return Verdict.MET
    as_many = 1.0 if not failures else float(bdtrc(failures - 1, runs, 1.0 - share))
    return Verdict.NOT_MET if as_many <= 1.0 - confidence else Verdict.NOT_ENOUGH_RUNS


def bound(values: Vector, share: float, confidence: float, upper: bool = True) -> float | None:
    """Value that a share of all flights stays below (above, if not `upper`) with a confidence; None with too few.

    Args:
        values: (n,) of the flights; NaN for one without a value counts as the worst.
        share: of all flights.
        confidence: that they do.
        upper: whether large values are bad.
    """
    allowed = allowed_failures(len(values), share, confidence)
    if allowed < 0:
        return None
    worst = inf if upper else -inf
    order = np.sort(np.where(np.isnan(values), worst, values))
    return float(order[len(order) - 1 - allowed] if upper else order[allowed])
