"""Filters on sensors of the relative state alone: they converge, as consistently as they say."""

from typing import Any

import numpy as np
import pytest

from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario


@pytest.mark.parametrize(
    ("sensors", "accuracy"),
    [(("gnss_position", "gnss_velocity"), 0.1), (("chief_range", "chief_range_rate", "bearing"), 0.1)],
    ids=["gnss", "ranging camera"],
)
def test_sensors_of_the_relative_state_observe_it(sensors: tuple[str, ...], accuracy: float) -> None:
    others = ("radius", "range_rate", "latitude")
    suite = {f"deputy1.sensors.{name}.on": name in sensors for name in (*others, *sensors)}
    suite["deputy1.sensors.chief_range.sigma"] = 0.1
    overrides = {"/plant": {"duration": 1200.0} | suite, "/**/navigation": {"fix_position_sigma": 20.0}}
    errors: list[Any] = []
    truth: list[Any] = []

    def sink(topic: str, message: Any) -> None:
        if topic == "/truth":
            truth.append(message.deputies[0].relative_state)
        if topic == "/deputy1/estimate":
            errors.append((message.relative_state - truth[-1], message.covariance, len(message.innovations)))

    Run(load_scenario("leader_follower", overrides)).fly(sink)
    error, covariance, _ = errors[-1]
    assert max(count for *_, count in errors) == len(sensors)
    assert np.linalg.norm(error[:3]) < accuracy  # of one reading
    # of six degrees of freedom, beyond which one in ten thousand lies
    assert error @ np.linalg.solve(covariance, error) < 27.9
