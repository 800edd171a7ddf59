"""Figures of a filter, from arrays and from recorded runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.analysis.navigation_figures import (
    EstimateHistory,
    common_stamps,
    estimate_history,
    figures_of_estimates,
    navigation_figures,
)
from formation_gnc.errors import BagError
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

TROUBLE = {
    "deputy1.sensors.radius.dropout": 0.3,
    "deputy1.sensors.latitude.outlier": 0.2,
    "deputy1.sensors.outage_start": 300.0,
    "deputy1.sensors.outage_duration": 100.0,
}


def recorded(directory: Path, duration: float = 600.0, **navigation: Any) -> Bag:
    overrides = {"/plant": {"duration": duration, **TROUBLE}, "/**/navigation": navigation}
    with BagWriter(directory, {}) as writer:
        Run(load_scenario("leader_follower", overrides)).fly(InProcessRecorder(writer))
    return Bag(directory)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    return recorded(tmp_path_factory.mktemp("navigation_figures") / "bag")


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    """Half of the same flight, with a filter that believes its radius less."""
    return recorded(tmp_path_factory.mktemp("navigation_figures") / "coarse", 300.0, radius_sigma=50.0)


def estimates(error: np.ndarray, sigma: float, readings: list[int], nis: list[float]) -> EstimateHistory:
    """Estimates of a truth of zeros."""
    count = len(error)
    covariance = np.tile(sigma**2 * np.eye(6), (count, 1, 1))
    return EstimateHistory(np.arange(count) * 10**9, error, covariance, np.array(nis), np.array(readings), {})


def test_figures_of_known_errors() -> None:
    error = np.zeros((4, 6))
    error[:, 0], error[:, 4] = [3.0, -3.0, 3.0, 4.0], 0.5
    known = estimates(error, 1.0, [0, 2, 1, 0], [9.0, 2.0, 4.0, 9.0])
    figures = figures_of_estimates(known, known.stamps, np.zeros((4, 6)))
    assert figures.estimates == 4
    assert figures.position_rms_m == pytest.approx(np.sqrt((3 * 9.0 + 16.0) / 4))
    assert figures.position_axes_rms_m == pytest.approx([figures.position_rms_m, 0.0, 0.0])
    assert figures.velocity_rms_m_s == pytest.approx(0.5)
    assert figures.final_position_m == 4.0
    assert figures.within_3_sigma == pytest.approx(23 / 24)
    assert figures.mean_nees == pytest.approx((3 * 9.0 + 16.0) / 4 + 0.25)
    assert figures.mean_nis == 3.0, "over the ticks with readings"
    assert figures.readings == 3


def test_a_consistent_filter_has_a_mean_nees_of_six() -> None:
    error = np.random.default_rng(1).normal(scale=2.0, size=(4000, 6))
    known = estimates(error, 2.0, [0] * 4000, [0.0] * 4000)
    figures = figures_of_estimates(known, known.stamps, np.zeros((4000, 6)))
    assert figures.mean_nees == pytest.approx(6.0, abs=0.2)
    assert figures.within_3_sigma == pytest.approx(0.9973, abs=0.002)
    assert figures.mean_nis == 0.0, "no readings"


def test_only_the_given_ticks_count() -> None:
    error = np.zeros((4, 6))
    error[2:, 0] = 10.0
    known = estimates(error, 1.0, [1] * 4, [1.0] * 4)
    figures = figures_of_estimates(known, known.stamps[:2], np.zeros((2, 6)))
    assert figures.position_rms_m == 0.0
    assert figures.readings == 2
    assert figures.estimates == 4


def test_figures_of_a_run_with_sensor_faults(bag: Bag) -> None:
    figures = navigation_figures(bag, "deputy1")
    assert figures.estimates == 600
    assert figures.rejections["gate"] > 0
    assert figures.readings == sum(estimate_history(bag, "deputy1").readings)
    assert figures.within_3_sigma > 0.95
    assert figures.position_rms_m == pytest.approx(np.linalg.norm(figures.position_axes_rms_m))


def test_two_runs_are_compared_on_their_common_ticks(bag: Bag, coarse: Bag) -> None:
    stamps = common_stamps(bag, coarse, "deputy1")
    assert len(stamps) == 300
    first, second = (navigation_figures(each, "deputy1", stamps) for each in (bag, coarse))
    assert (first.estimates, second.estimates) == (600, 300)
    assert second.mean_nis < first.mean_nis
    assert second == navigation_figures(coarse, "deputy1"), "all its ticks are common"
    assert first != navigation_figures(bag, "deputy1")


def test_a_run_without_estimates_is_named(bag: Bag, tmp_path: Path) -> None:
    with pytest.raises(BagError, match="has no estimate of deputy9"):
        navigation_figures(bag, "deputy9")
    with pytest.raises(BagError, match="no tick with a truth and an estimate of deputy1"):
        navigation_figures(bag, "deputy1", np.array([-1]))
    BagWriter(tmp_path / "empty", {}).close()
    with pytest.raises(BagError, match="has no estimate of deputy1"):
        common_stamps(bag, Bag(tmp_path / "empty"), "deputy1")
