"""Verdicts by order statistics against printed tables and SciPy's binomial distribution."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import binom

from formation_gnc.campaign.order_statistics import Verdict, allowed_failures, bound, runs_needed, verdict

SHARES = st.sampled_from([0.5, 0.9, 0.95, 0.99, 0.9973])
CONFIDENCES = st.sampled_from([0.5, 0.9, 0.95, 0.99])


@pytest.mark.parametrize(
    ("share", "confidence", "failures", "runs"),
    [
        (0.9973, 0.90, 0, 852),  # ln 0.1 / ln 0.9973
        (0.95, 0.95, 0, 59),  # Wilks' first three orders, 95/95
        (0.95, 0.95, 1, 93),
        (0.95, 0.95, 2, 124),
        (0.99, 0.99, 0, 459),
        (0.90, 0.90, 0, 22),
    ],
)
def test_runs_needed_are_those_of_the_tables(share, confidence, failures, runs):
    assert runs_needed(failures, share, confidence) == runs
    assert verdict(failures, runs, share, confidence) is Verdict.MET
    assert verdict(failures, runs - 1, share, confidence) is Verdict.NOT_ENOUGH_RUNS


@given(st.integers(1, 1000), SHARES, CONFIDENCES)
def test_allowed_failures_are_the_quantile_of_the_binomial(runs, share, confidence):
    counts = np.arange(runs + 1)
    chances = binom.cdf(counts, runs, 1.0 - share)
    assume(np.abs(chances + confidence - 1.0).min() > 1e-12)  # a tie is a matter of rounding
    enough = counts[chances <= 1.0 - confidence]
    assert allowed_failures(runs, share, confidence) == (enough[-1] if len(enough) else -1)


@given(st.integers(1, 2000), st.integers(0, 40), SHARES, CONFIDENCES)
def test_not_met_is_claimed_at_the_same_confidence(runs, failures, share, confidence):
    failures = min(failures, runs)
    found = verdict(failures, runs, share, confidence)
    if found is Verdict.NOT_MET:
        assert binom.sf(failures - 1, runs, 1.0 - share) <= 1.0 - confidence
    if found is Verdict.MET:
        assert binom.cdf(failures, runs, 1.0 - share) <= 1.0 - confidence


def test_no_run_shows_nothing():
    assert verdict(0, 0, 0.9, 0.9) is Verdict.NOT_ENOUGH_RUNS


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=300), st.floats(-10.0, 10.0), st.booleans())
def test_margin_is_positive_exactly_when_the_requirement_is_met(values, limit, upper):
    numbers = np.array(values)
    good = numbers <= limit if upper else numbers >= limit
    reached = bound(numbers, 0.9, 0.9, upper)
    met = verdict(int((~good).sum()), len(numbers), 0.9, 0.9) is Verdict.MET
    assert met == (reached is not None and (reached <= limit if upper else reached >= limit))


def test_a_flight_without_a_figure_counts_as_the_worst():
    values = np.full(59, 1.0)
    assert bound(values, 0.95, 0.95) == 1.0
    values[7] = np.nan
    assert bound(values, 0.95, 0.95) == np.inf
