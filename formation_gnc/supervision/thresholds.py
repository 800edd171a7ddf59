"""Thresholds from the probability of a false alarm, for innovations that are white and normal with unit variance."""

from functools import cache
from math import expm1, log, sqrt

from scipy.optimize import brentq
from scipy.special import chdtri, ndtri

SUSPICION = 100.0
"""Suspicion is raised so many times as often as a failure, without a fault."""

OVERSHOOT = 1.166
"""Mean excess over a boundary of a normal random walk, twice over, in standard deviations (Siegmund 1985)."""


@cache
def cusum_run_length(reference: float, threshold: float) -> float:
    """Mean number of samples to an alarm of a one-sided CUSUM (Siegmund's approximation).

    (exp(2 k b) - 2 k b - 1) / (2 k^2) with b = h + 1.166.

    Args:
        reference: k, subtracted from every sample; not zero.
        threshold: h.
    """
    exponent = 2.0 * reference * (threshold + OVERSHOOT)
    return (expm1(exponent) - exponent) / (2.0 * reference**2)


@cache
def cusum_threshold(reference: float, samples: int, probability: float) -> float:
    """Threshold of a two-sided CUSUM that a number of samples crosses with a probability at most.

    Run lengths to a false alarm are geometric: n samples cross with n / L on each side.
    """
    wanted = 2.0 * max(1, samples) / probability
    return float(
        brentq(lambda h: log(cusum_run_length(reference, h)) - log(wanted), 0.0, (log(wanted) + 40.0) / reference)
    )


def cusum_delay(reference: float, threshold: float, shift: float) -> float:
    """Mean number of samples from a shift to the alarm of the side that it is on: Siegmund's formula at k - shift."""
    if shift == reference:
        return (threshold + OVERSHOOT) ** 2
    return cusum_run_length(reference - shift, threshold)


@cache
def normal_threshold(samples: int, probability: float) -> float:
    """Deviation, in standard deviations, that one of a number of samples exceeds with a probability, either side."""
    return -float(ndtri(0.5 * probability / max(1, samples)))


@cache
def chi_square_limit(freedom: int, samples: int, probability: float) -> float:
    """Chi-square that any of a number of samples exceeds with a probability at most."""
    return float(chdtri(freedom, probability / max(1, samples)))


@cache
def repeats(chance: float, samples: int, probability: float) -> int:
    """Length of a run, each with a chance, that begins at any of a number of samples with a probability at most."""
    return max(2, -int(log(probability / max(1, samples)) // -log(chance)) if chance < 1.0 else samples)


def suspicion(probability: float) -> float:
    """Probability that a flight without a fault raises a suspicion, given that of a failure."""
    return min(0.5, SUSPICION * probability)


def standard_deviations(variances: list[float]) -> list[float]:
    """Square roots; NaN for what is no variance."""
    return [sqrt(each) if each >= 0.0 else float("nan") for each in variances]
