"""Thresholds against sampled false alarms and delays."""

import numpy as np
import pytest

from formation_gnc.supervision.cusum import Cusum
from formation_gnc.supervision.thresholds import (
    chi_square_limit,
    cusum_delay,
    cusum_run_length,
    cusum_threshold,
    normal_threshold,
    repeats,
)


def run_lengths(reference: float, threshold: float, shift: float, runs: int) -> float:
    """Mean samples until a one-sided CUSUM crosses its threshold."""
    random = np.random.default_rng(1)
    sums, alive, count = np.zeros(runs), np.ones(runs, dtype=bool), np.zeros(runs)
    while alive.any():
        sums = np.maximum(0.0, sums + random.standard_normal(runs) + shift - reference)
        count[alive] += 1
        alive &= sums < threshold
    return float(count.mean())


@pytest.mark.parametrize(("reference", "threshold"), [(1.0, 2.5), (0.5, 4.0), (0.25, 6.0)])
def test_siegmunds_run_length_is_that_of_sampled_sums(reference: float, threshold: float) -> None:
    # 3000 geometric run lengths: a standard error of 2 %. Siegmund's formula is good to 10 % at these short ones.
    sampled = run_lengths(reference, threshold, 0.0, 3000)
    assert cusum_run_length(reference, threshold) == pytest.approx(sampled, rel=0.15)


@pytest.mark.parametrize("shift", [0.5, 1.0, 2.0, 4.0])
def test_delay_of_a_cusum_is_that_of_sampled_sums(shift: float) -> None:
    threshold = cusum_threshold(0.5, 10_000, 1e-3)
    # within a sample, since an alarm takes a whole number of them
    assert cusum_delay(0.5, threshold, shift) == pytest.approx(
        run_lengths(0.5, threshold, shift, 2000), rel=0.05, abs=1.0
    )


@pytest.mark.parametrize("reference", [0.25, 1.0])
@pytest.mark.parametrize("probability", [1e-2, 1e-5])
def test_a_threshold_gives_the_run_length_that_was_asked_for(reference: float, probability: float) -> None:
    threshold = cusum_threshold(reference, 5000, probability)
    assert 5000 / cusum_run_length(reference, threshold) * 2.0 == pytest.approx(probability, rel=1e-6)


def test_thresholds_raise_as_many_false_alarms_as_stated() -> None:
    """A thousand flights of 200 samples, with one alarm in ten asked for: within four standard deviations, or fewer."""
    random, flights, samples, probability = np.random.default_rng(2), 1000, 200, 0.1
    noise = random.standard_normal((flights, samples))
    limit = probability + 4.0 * (probability * (1.0 - probability) / flights) ** 0.5
    threshold = cusum_threshold(1.0, samples, probability)
    alarms = 0
    for flight in noise.tolist():
        cusum = Cusum(1.0, threshold)
        alarms += any(cusum.add(sample) >= threshold for sample in flight)
    assert alarms / flights < limit
    assert np.mean((np.abs(noise) > normal_threshold(samples, probability)).any(axis=1)) < limit
    squares = random.chisquare(3, (flights, samples))
    assert np.mean((squares > chi_square_limit(3, samples, probability)).any(axis=1)) < limit


def test_an_outlier_alone_raises_no_alarm_of_a_cusum() -> None:
    threshold = cusum_threshold(1.0, 1000, 1e-4)
    cusum = Cusum(1.0, threshold)
    assert cusum.add(1e300) < threshold
    assert cusum.add(float("nan")) == cusum.add(float("inf"))


def test_a_cusum_comes_down_when_the_fault_is_over() -> None:
    threshold = cusum_threshold(1.0, 1000, 1e-4)
    cusum = Cusum(1.0, threshold)
    for _ in range(10_000):
        cusum.add(4.0)
    assert sum(cusum.add(0.0) >= threshold for _ in range(1000)) <= threshold + 1


def test_a_run_of_repeats_is_as_rare_as_stated() -> None:
    count = repeats(1e-3, 10_000, 1e-5)
    assert 10_000 * 1e-3**count <= 1e-5 < 10_000 * 1e-3 ** (count - 1)
