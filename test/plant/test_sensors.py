"""Sensors of the plant: each with errors of its own, of the size it was given."""

from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.plant.sensors import SensorParameters, Sensors, SensorSuite, read
from formation_gnc.records import Sensor
from formation_gnc.types import NANOSECONDS

CHIEF = state_from_elements(Elements(7e6, 0.01, 0.9, 0.3, 0.2, 0.1))
DEPUTY = CHIEF + np.array([100.0, -200.0, 50.0, 0.1, 0.2, -0.3])

Delivered = dict[int, list[tuple[int, float, float]]]


def flown(ticks: int = 4000, seed: int = 1, tick: float = 1.0, **changes: Any) -> Delivered:
    """What arrived in a flight that stands still: tick, value and age of every reading by sensor."""
    sensors = Sensors(SensorSuite(**changes), round(tick * NANOSECONDS), seed, "deputy1")
    arrived: Delivered = {int(sensor): [] for sensor in Sensor}
    for number in range(ticks):
        for sensor, value, age in zip(*sensors.readings(number, DEPUTY, CHIEF), strict=True):
            arrived[sensor].append((number, value, age))
    return arrived


def errors(delivered: Delivered, sensor: Sensor) -> np.ndarray:
    return np.array([value for _, value, _ in delivered[sensor]]) - read(sensor, DEPUTY, CHIEF)


def test_noise_and_bias_are_those_asked_for() -> None:
    model = SensorParameters(sigma=5.0, bias=3.0, interval=1.0)
    error = errors(flown(radius=model), Sensor.RADIUS)
    # 4000 samples: the mean is known to 0.08, the deviation to 0.056; four of these
    assert error.mean() == pytest.approx(3.0, abs=0.32)
    assert error.std() == pytest.approx(5.0, abs=0.23)


def test_only_what_is_on_reads_and_each_at_its_interval() -> None:
    arrived = flown(100, latitude=SensorParameters(sigma=1e-6, interval=7.0), range_rate=SensorParameters(on=False))
    assert [tick for tick, _, _ in arrived[Sensor.RADIUS]] == list(range(0, 100, 10))
    assert [tick for tick, _, _ in arrived[Sensor.LATITUDE]] == list(range(0, 100, 7))
    assert not arrived[Sensor.RANGE_RATE]
    assert not arrived[Sensor.RIGHT_ASCENSION]


def test_latency_delivers_what_was_read_then_with_its_age() -> None:
    plain = flown(100)
    late = flown(100, radius=SensorParameters(sigma=5.0, latency=25.0))
    assert [(tick + 25, value) for tick, value, _ in plain[Sensor.RADIUS]][:8] == [
        (tick, value) for tick, value, _ in late[Sensor.RADIUS]
    ]
    assert {age for _, _, age in late[Sensor.RADIUS]} == {25.0}


def test_dropouts_leave_the_other_readings_as_they_were() -> None:
    plain, gaps = flown(), flown(radius=SensorParameters(sigma=5.0, dropout=0.3))
    kept = set(gaps[Sensor.RADIUS])
    assert kept < set(plain[Sensor.RADIUS])
    assert len(kept) / len(plain[Sensor.RADIUS]) == pytest.approx(0.7, abs=0.1)  # of 400: four sigma
    assert gaps[Sensor.LATITUDE] == plain[Sensor.LATITUDE]


def test_outliers_are_as_frequent_and_as_large_as_asked_for() -> None:
    model = SensorParameters(sigma=5.0, interval=1.0, outlier=0.01, outlier_size=50.0)
    error = errors(flown(radius=model), Sensor.RADIUS)
    wild = np.abs(error) > 125.0
    assert wild.mean() == pytest.approx(0.01, abs=0.0065)
    assert np.abs(error[wild]).mean() == pytest.approx(250.0, abs=5.0)
    assert {-1.0, 1.0} == set(np.sign(error[wild]))


def test_an_outage_silences_everything_for_its_time() -> None:
    arrived = flown(1000, outage_start=200.0, outage_duration=300.0)
    for sensor in (Sensor.RADIUS, Sensor.RANGE_RATE, Sensor.LATITUDE):
        ticks = np.array([tick for tick, _, _ in arrived[sensor]])
        assert not ((ticks >= 200) & (ticks < 500)).any()
        assert len(ticks) == 70


def test_a_sensor_more_changes_nothing_about_the_others() -> None:
    plain = flown()
    more = flown(right_ascension=SensorParameters(sigma=1e-6), chief_range=SensorParameters(sigma=1.0))
    assert more[Sensor.RIGHT_ASCENSION]
    for sensor in (Sensor.RADIUS, Sensor.RANGE_RATE, Sensor.LATITUDE):
        assert more[sensor] == plain[sensor]
    distance = np.mean([value for _, value, _ in more[Sensor.CHIEF_RANGE]])
    assert distance == pytest.approx(np.linalg.norm(DEPUTY[:3] - CHIEF[:3]), abs=0.2)  # 400 samples of 1 m


def test_the_errors_of_different_sensors_are_independent() -> None:
    delivered = flown(20000)
    one, other = errors(delivered, Sensor.RADIUS), errors(delivered, Sensor.LATITUDE)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.09  # of 2000: four sigma


@pytest.mark.parametrize("name", ["interval", "latency"])
def test_what_is_not_whole_ticks_is_rejected_by_name(name: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"deputy1\.sensors\.latitude\.{name}.*0\.5"):
        flown(1, latitude=SensorParameters(**{name: 0.5}))
