"""Timing and error models of the plant's sensors."""

from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.plant.sensors import Sensors, SensorSuite
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import NANOSECONDS

CHIEF = state_from_elements(Elements(7e6, 0.01, 0.9, 0.3, 0.2, 0.1))
DEPUTY = CHIEF + np.array([100.0, -200.0, 50.0, 0.1, 0.2, -0.3])

Delivered = dict[str, list[tuple[int, float, int]]]


def delivered(ticks: int = 4000, seed: int = 1, tick: float = 1.0, **changes: Any) -> Delivered:
    """Tick, value and age (ns) of every reading by sensor, of satellites that stand still."""
    named = {name.replace("__", "."): value for name, value in changes.items()}
    suite = Sensors(load(SensorSuite, named), round(tick * NANOSECONDS), seed, "deputy1")
    arrived: Delivered = {sensor: [] for sensor in sensors()}
    for number in range(ticks):
        for reading in suite.readings(number, DEPUTY, CHIEF):
            arrived[reading.sensor].append((number, reading.values[0], reading.age))
    return arrived


def errors(arrived: Delivered, sensor: str) -> np.ndarray:
    (truth,) = sensors()[sensor].measure(DEPUTY.tolist(), CHIEF.tolist())
    return np.array([value for _, value, _ in arrived[sensor]]) - truth


def test_noise_and_bias_are_those_asked_for() -> None:
    error = errors(delivered(radius__bias=3.0, radius__interval=1.0), "radius")
    # 4000 samples: the mean is known to 0.08, the deviation to 0.056; four of these
    assert error.mean() == pytest.approx(3.0, abs=0.32)
    assert error.std() == pytest.approx(5.0, abs=0.23)


def test_only_what_is_on_reads_and_each_at_its_interval() -> None:
    arrived = delivered(100, latitude__interval=7.0, range_rate__on=False)
    assert [tick for tick, _, _ in arrived["radius"]] == list(range(0, 100, 10))
    assert [tick for tick, _, _ in arrived["latitude"]] == list(range(0, 100, 7))
    assert not arrived["range_rate"]
    assert not arrived["right_ascension"]


def test_latency_delivers_what_was_read_then_with_its_age() -> None:
    plain = delivered(100)
    late = delivered(100, radius__latency=25.0)
    assert [(tick + 25, value) for tick, value, _ in plain["radius"]][:8] == [
        (tick, value) for tick, value, _ in late["radius"]
    ]
    assert {age for _, _, age in late["radius"]} == {25 * NANOSECONDS}


def test_dropouts_leave_the_other_readings_as_they_were() -> None:
    plain, gaps = delivered(), delivered(radius__dropout=0.3)
    kept = set(gaps["radius"])
    assert kept < set(plain["radius"])
    assert len(kept) / len(plain["radius"]) == pytest.approx(0.7, abs=0.1)  # of 400: four sigma
    assert gaps["latitude"] == plain["latitude"]


def test_outliers_are_as_frequent_and_as_large_as_asked_for() -> None:
    error = errors(delivered(radius__interval=1.0, radius__outlier=0.01, radius__outlier_size=50.0), "radius")
    wild = np.abs(error) > 125.0
    assert wild.mean() == pytest.approx(0.01, abs=0.0065)
    assert np.abs(error[wild]).mean() == pytest.approx(250.0, abs=5.0)
    assert {-1.0, 1.0} == set(np.sign(error[wild]))


def test_an_outage_silences_everything_for_its_time() -> None:
    arrived = delivered(1000, outage_start=200.0, outage_duration=300.0)
    for sensor in ("radius", "range_rate", "latitude"):
        ticks = np.array([tick for tick, _, _ in arrived[sensor]])
        assert not ((ticks >= 200) & (ticks < 500)).any()
        assert len(ticks) == 70


def test_another_sensor_changes_nothing_about_the_others() -> None:
    plain = delivered()
    more = delivered(right_ascension__on=True, chief_range__on=True)
    assert more["right_ascension"]
    for sensor in ("radius", "range_rate", "latitude"):
        assert more[sensor] == plain[sensor]
    distance = np.mean([value for _, value, _ in more["chief_range"]])
    assert distance == pytest.approx(np.linalg.norm(DEPUTY[:3] - CHIEF[:3]), abs=0.2)  # 400 samples of 1 m


def test_the_errors_of_different_sensors_are_independent() -> None:
    arrived = delivered(20000)
    one, other = errors(arrived, "radius"), errors(arrived, "latitude")
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.09  # of 2000: four sigma


@pytest.mark.parametrize("name", ["interval", "latency"])
def test_what_is_not_whole_ticks_is_rejected_by_name(name: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"deputy1\.sensors\.latitude\.{name}.*0\.5"):
        delivered(1, **{f"latitude__{name}": 0.5})
