"""Scale of white noise among outliers."""

import numpy as np
import pytest

from formation_gnc.navigation.robust_scale import white_noise


@pytest.mark.parametrize("size", [1, 3])
@pytest.mark.parametrize("outliers", [0.0, 0.1, 0.3])
def test_the_variance_of_white_noise_is_found_among_outliers(size: int, outliers: float) -> None:
    rng = np.random.default_rng(1)
    values = 4.0 * rng.standard_normal((4000, size))
    values[rng.random(4000) < outliers] *= 1e6
    found = white_noise(values)
    assert found.is_white
    # outliers split the series where they are: a bias of none, and the scatter of 2800 values
    assert found.variance == pytest.approx(16.0, rel=0.1)


def test_a_slow_drift_is_not_white_and_leaves_the_variance() -> None:
    rng = np.random.default_rng(2)
    drift = 50.0 + 20.0 * np.sin(np.linspace(0.0, 3.0, 60))
    found = white_noise((drift + rng.standard_normal(60))[:, None])
    assert not found.is_white
    assert found.variance == pytest.approx(1.0, rel=0.6)  # 59 differences


def test_scale_follows_the_unit() -> None:
    values = np.random.default_rng(3).standard_normal((40, 1))
    assert white_noise(1e6 * values).variance == pytest.approx(1e12 * white_noise(values).variance)


def test_values_that_are_all_alike_have_no_noise() -> None:
    assert white_noise(np.full((5, 1), 3.0)).variance == 0.0
