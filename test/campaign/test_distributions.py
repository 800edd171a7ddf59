"""Distributions: moments, bounds and correlations of what is drawn, and what is refused."""

import numpy as np
import pytest
from scipy import stats

from formation_gnc.campaign.distributions import LEAST, distribution_of
from formation_gnc.errors import ConfigurationError
from formation_gnc.randomness import generator

DRAWS = 4_000

KNOWN = {
    "normal": ({"normal": {"mean": 3.0, "sigma": 2.0}}, stats.norm(3.0, 2.0)),
    "uniform": ({"uniform": {"low": -1.0, "high": 4.0}}, stats.uniform(-1.0, 5.0)),
    "log_normal": ({"log_normal": {"median": 2.0, "sigma": 0.3}}, stats.lognorm(0.3, scale=2.0)),
    "truncated normal": (
        {"normal": {"mean": 3.0, "sigma": 2.0}, "within": [2.0, 4.0]},
        stats.truncnorm(-0.5, 0.5, 3.0, 2.0),
    ),
}


@pytest.mark.parametrize("name", KNOWN)
def test_draws_have_the_distribution_that_they_are_asked_for(name):
    """Kolmogorov-Smirnov; a fixed seed, so that the test holds or fails for good."""
    spec, truth = KNOWN[name]
    drawn = distribution_of(spec).draw(generator(1, "test"), DRAWS)
    assert stats.kstest(drawn, truth.cdf).pvalue > 0.01


def test_choice_draws_by_weight():
    drawn = distribution_of({"choice": {"of": ["a", "b"], "weights": [1.0, 3.0]}}).draw(generator(1, "test"), DRAWS)
    assert drawn.count("b") / DRAWS == pytest.approx(0.75, abs=4.0 * np.sqrt(0.75 * 0.25 / DRAWS))


def test_relative_state_has_the_covariance_of_its_correlations():
    sigma = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]
    both = distribution_of({"hill_normal": {"sigma": sigma, "correlation": {"x vy": -0.9, "y vx": 0.4}}})
    random = generator(1, "test")
    drawn = np.array([both.draw(random, 6) for _ in range(DRAWS)])
    expected = np.eye(6)
    expected[0, 4] = expected[4, 0] = -0.9
    expected[1, 3] = expected[3, 1] = 0.4
    assert np.std(drawn, axis=0) == pytest.approx(sigma, rel=4.0 / np.sqrt(2.0 * DRAWS))
    assert np.corrcoef(drawn.T) == pytest.approx(expected, abs=4.0 / np.sqrt(DRAWS))


def test_no_draw_leaves_the_support():
    """The extremes of the uniform numbers that all draws are made from."""
    for spec, _ in KNOWN.values():
        distribution = distribution_of(spec)
        low, high = distribution.support()
        assert np.isfinite([low, high]).all()
        assert (
            low
            <= distribution.quantile(LEAST)
            <= distribution.quantile(0.5)
            <= distribution.quantile(1 - LEAST)
            <= high
        )


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        (3.0, "must be like"),
        ({}, "needs one distribution"),
        ({"normal": {}, "uniform": {}}, "needs one distribution, has normal, uniform"),
        ({"gauss": {"mean": 1.0, "sigma": 1.0}}, "distribution gauss: unknown"),
        ({"normal": {"mean": 1.0}}, "must have mean, sigma"),
        ({"normal": {"mean": 1.0, "sigma": 0.0}}, "sigma: 0.0 is not allowed; it must be above 0"),
        ({"normal": {"mean": "a", "sigma": 1.0}}, "mean: 'a' is not allowed"),
        ({"uniform": {"low": 2.0, "high": 1.0}}, "high: 1.0 is not allowed; it must be above low, 2.0"),
        ({"log_normal": {"median": -1.0, "sigma": 1.0}}, "median: -1.0"),
        ({"choice": {"of": [1]}}, "two values or more"),
        ({"choice": {"of": [1, 2], "weights": [1.0]}}, "it must be 2 numbers above 0"),
        ({"normal": {"mean": 0.0, "sigma": 1.0}, "within": [50.0, 60.0]}, "nothing of the distribution is in it"),
        ({"normal": {"mean": 0.0, "sigma": 1.0}, "within": [1.0]}, "two numbers"),
        ({"choice": {"of": [1, 2]}, "within": [0.0, 1.0]}, "not allowed for choice"),
        ({"hill_normal": {"sigma": [1.0]}}, "6 numbers"),
        ({"hill_normal": {"sigma": [1.0] * 6, "correlation": {"x q": 0.1}}}, "'x q': is unknown"),
        ({"hill_normal": {"sigma": [1.0] * 6, "correlation": {"x y": 2.0}}}, "from -1 to 1"),
        (
            {"hill_normal": {"sigma": [1.0] * 6, "correlation": {"x y": 0.9, "y z": 0.9, "x z": -0.9}}},
            "positive semidefinite",
        ),
    ],
)
def test_what_is_no_distribution_is_refused_with_what_is_allowed(spec, words):
    with pytest.raises(ConfigurationError) as refusal:
        distribution_of(spec)
    assert words in str(refusal.value)
