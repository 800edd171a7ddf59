"""Errors of the plant's readings: as large as the error model says, white, and independent streams."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from formation_gnc.parameters import load
from formation_gnc.plant.sensors import Sensors, SensorSuite
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import Sensor
from formation_gnc.types import NANOSECONDS

Array = NDArray[np.float64]

COUNT = 4000
"""Readings that a statistic is taken over: its own scatter is 1 / sqrt(COUNT) = 1.6 %."""
FIVE_SIGMA = 5.0 / math.sqrt(COUNT)

CHIEF = np.array([7.0e6, 0.0, 0.0, 0.0, 1000.0, 7400.0])
DEPUTY = np.array([-2.0e6, 5.0e6, 4.0e6, -6000.0, -3000.0, 2500.0])
ALL_ON = {f"{name}.on": True for name in sensors()}
EVERY_TICK = {f"{name}.interval": 1.0 for name in sensors()}


def suite(seed: int = 1, deputy: str = "deputy1", **values: Any) -> Sensors:
    named = {name.replace("__", "."): value for name, value in values.items()}
    return Sensors(load(SensorSuite, ALL_ON | EVERY_TICK | named), NANOSECONDS, seed, deputy)


def errors(suite: Sensors, ticks: int = COUNT) -> dict[str, Array]:
    """Readings minus truth by sensor, (N, size), over ticks in order, one state throughout."""
    found: dict[str, list[Array]] = {}
    for tick in range(ticks):
        for reading in suite.readings(tick, DEPUTY, CHIEF):
            truth = sensors()[reading.sensor].measure(DEPUTY.tolist(), CHIEF.tolist())
            found.setdefault(reading.sensor, []).append(np.subtract(reading.values, truth))
    return {sensor: np.array(values) for sensor, values in found.items()}


@pytest.mark.parametrize("sensor", sensors().values(), ids=lambda sensor: sensor.name)
def test_noise_is_white_normal_and_of_the_stated_size(sensor: Sensor) -> None:
    for noise in errors(suite())[sensor.name].T / np.array(sensor.sigma)[:, None]:
        # the reading's own rounding is below 1e-3 of the noise of every sensor
        assert abs(noise.mean()) < FIVE_SIGMA
        assert abs(noise.std() - 1.0) < FIVE_SIGMA / math.sqrt(2.0)
        assert kstest(noise, "norm").pvalue > 1e-4
        for lag in range(1, 6):
            assert abs(np.corrcoef(noise[lag:], noise[:-lag])[0, 1]) < FIVE_SIGMA


def test_sensors_and_deputies_err_independently_of_one_another() -> None:
    found = [*errors(suite()).values(), *errors(suite(deputy="deputy2")).values()]
    streams = [stream for values in found for stream in values.T]
    assert len(streams) == 2 * sum(sensor.size for sensor in sensors().values())
    for one, other in itertools.combinations(streams, 2):
        assert abs(np.corrcoef(one, other)[0, 1]) < FIVE_SIGMA


def test_the_same_seed_gives_the_same_bits_and_another_seed_others() -> None:
    first, again, other = (errors(suite(seed), 50) for seed in (7, 7, 8))
    for sensor in sensors():
        assert first[sensor].tolist() == again[sensor].tolist()
        assert not np.isin(first[sensor], other[sensor]).any()


@pytest.mark.parametrize(
    "change",
    [
        {"latitude__on": False},
        {"latitude__sigma": 1.0},
        {"latitude__interval": 3.0},
        {"latitude__dropout": 0.5, "latitude__outlier": 0.5},
        {"latitude__latency": 4.0},
    ],
)
def test_what_is_set_for_one_sensor_changes_nothing_for_another(change: dict[str, Any]) -> None:
    before, after = errors(suite(), 100), errors(suite(**change), 100)
    for sensor in set(sensors()) - {"latitude"}:
        assert before[sensor].tolist() == after[sensor].tolist()


def test_fixes_and_readings_do_not_change_one_another() -> None:
    quiet, busy = suite(), suite()
    for tick in range(30):
        busy.fix(np.zeros(6))
        assert quiet.readings(tick, DEPUTY, CHIEF) == busy.readings(tick, DEPUTY, CHIEF)
    fresh = suite()
    fixes = [fresh.fix(np.zeros(6)).tolist() for _ in range(3)]
    late = suite()
    errors(late, 10)
    assert [late.fix(np.zeros(6)).tolist() for _ in range(3)] == fixes


def test_a_fix_errs_by_what_is_stated_on_every_axis() -> None:
    fixes = suite(fix_position_sigma=2.0, fix_velocity_sigma=0.003)
    truth = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    noise = (np.array([fixes.fix(truth) for _ in range(COUNT)]) - truth) / np.repeat([2.0, 0.003], 3)
    assert np.abs(noise.mean(axis=0)).max() < FIVE_SIGMA
    assert np.abs(noise.std(axis=0) - 1.0).max() < FIVE_SIGMA / math.sqrt(2.0)
    assert np.abs(np.corrcoef(noise.T) - np.eye(6)).max() < FIVE_SIGMA


def test_without_noise_the_reading_is_the_truth() -> None:
    silent = suite(
        **{f"{name}__sigma": 0.0 if sensor.size == 1 else [0.0] * sensor.size for name, sensor in sensors().items()}
    )
    assert all(not found.any() for found in errors(silent, 20).values())
