"""What sensors read of the truth, how white and normal their noise is, and that no stream touches another."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import kstest

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.parameters import load
from formation_gnc.plant.sensors import Sensors, SensorSuite, read
from formation_gnc.records import Sensor
from formation_gnc.types import NANOSECONDS

Array = NDArray[np.float64]

COUNT = 4000
"""Readings that a statistic is taken over: its own scatter is 1 / sqrt(COUNT) = 1.6 %."""
FIVE_SIGMA = 5.0 / math.sqrt(COUNT)

CHIEF = np.array([7.0e6, 0.0, 0.0, 0.0, 1000.0, 7400.0])
DEPUTY = np.array([-2.0e6, 5.0e6, 4.0e6, -6000.0, -3000.0, 2500.0])
ALL_ON = {f"{sensor.name.lower()}.on": True for sensor in Sensor}
EVERY_TICK = {f"{sensor.name.lower()}.interval": 1.0 for sensor in Sensor}
SIGMA = {Sensor.RADIUS: 5.0, Sensor.RANGE_RATE: 0.01, Sensor.LATITUDE: 1e-6}
SIGMA |= {Sensor.RIGHT_ASCENSION: 1e-6, Sensor.CHIEF_RANGE: 1.0}


def sensors(seed: int = 1, deputy: str = "deputy1", **values: Any) -> Sensors:
    named = {name.replace("__", "."): value for name, value in values.items()}
    return Sensors(load(SensorSuite, ALL_ON | EVERY_TICK | named), NANOSECONDS, seed, deputy)


def errors(suite: Sensors, ticks: int = COUNT) -> dict[Sensor, Array]:
    """Readings minus truth of every sensor, over ticks in order, one state throughout."""
    found: dict[Sensor, list[float]] = {}
    for tick in range(ticks):
        kinds, values, _ = suite.readings(tick, DEPUTY, CHIEF)
        for kind, value in zip(kinds, values, strict=True):
            found.setdefault(Sensor(kind), []).append(value - read(Sensor(kind), DEPUTY, CHIEF))
    return {kind: np.array(values) for kind, values in found.items()}


orbits = st.builds(
    Elements,
    semi_major_axis=st.floats(8e6, 4e7),
    eccentricity=st.floats(0.0, 0.15),
    inclination=st.floats(0.0, math.pi),
    right_ascension=st.floats(-3.0, 3.0),
    argument_of_perigee=st.floats(-3.0, 3.0),
    true_anomaly=st.floats(-3.0, 3.0),
)


@given(orbits, st.floats(-math.pi, math.pi))
def test_readings_follow_from_the_elements_of_the_orbit(orbit: Elements, turn: float) -> None:
    state = state_from_elements(orbit)
    parameter = orbit.semi_major_axis * (1.0 - orbit.eccentricity**2)
    radius = parameter / (1.0 + orbit.eccentricity * math.cos(orbit.true_anomaly))
    rate = math.sqrt(MU / parameter) * orbit.eccentricity * math.sin(orbit.true_anomaly)
    argument = orbit.argument_of_perigee + orbit.true_anomaly
    sine = math.sin(orbit.inclination) * math.sin(argument)
    assert read(Sensor.RADIUS, state, CHIEF) == pytest.approx(radius, rel=1e-14)
    assert read(Sensor.RANGE_RATE, state, CHIEF) == pytest.approx(rate, abs=1e-11)  # rounding at 1e4 m/s
    assert math.sin(read(Sensor.LATITUDE, state, CHIEF)) == pytest.approx(sine, abs=1e-14)
    node = orbit.right_ascension
    east = math.atan2(math.cos(orbit.inclination) * math.sin(argument), math.cos(argument)) + node
    if abs(sine) < 0.999:
        off = read(Sensor.RIGHT_ASCENSION, state, CHIEF) - east
        assert math.remainder(off, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-13 / (1.0 - sine**2))
    c, s = math.cos(turn), math.sin(turn)
    about_axis = np.kron(np.eye(2), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for sensor in (Sensor.RADIUS, Sensor.RANGE_RATE, Sensor.LATITUDE):  # none of them sees such a turn
        here, there = read(sensor, state, CHIEF), read(sensor, about_axis @ state, CHIEF)
        assert there == pytest.approx(here, rel=1e-14, abs=1e-11)


@given(orbits, orbits)
def test_the_range_to_the_chief_is_the_same_from_either_end(one: Elements, other: Elements) -> None:
    deputy, chief = state_from_elements(one), state_from_elements(other)
    distance = read(Sensor.CHIEF_RANGE, deputy, chief)
    assert distance == read(Sensor.CHIEF_RANGE, chief, deputy)
    assert distance == pytest.approx(float(np.linalg.norm(deputy[:3] - chief[:3])), rel=1e-14)


@pytest.mark.parametrize("sensor", list(Sensor))
def test_noise_is_white_normal_and_of_the_stated_size(sensor: Sensor) -> None:
    noise = errors(sensors())[sensor] / SIGMA[sensor]
    # the reading's own rounding is below 1e-3 of the noise of every sensor
    assert abs(noise.mean()) < FIVE_SIGMA
    assert abs(noise.std() - 1.0) < FIVE_SIGMA / math.sqrt(2.0)
    assert kstest(noise, "norm").pvalue > 1e-4
    for lag in range(1, 6):
        assert abs(np.corrcoef(noise[lag:], noise[:-lag])[0, 1]) < FIVE_SIGMA


def test_sensors_and_deputies_err_independently_of_one_another() -> None:
    streams = [*errors(sensors()).values(), *errors(sensors(deputy="deputy2")).values()]
    assert len(streams) == 2 * len(Sensor)
    for one, other in itertools.combinations(streams, 2):
        assert abs(np.corrcoef(one, other)[0, 1]) < FIVE_SIGMA


def test_the_same_seed_gives_the_same_bits_and_another_seed_others() -> None:
    first, again, other = (errors(sensors(seed), 50) for seed in (7, 7, 8))
    for sensor in Sensor:
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
    before, after = errors(sensors(), 100), errors(sensors(**change), 100)
    for sensor in set(Sensor) - {Sensor.LATITUDE}:
        assert before[sensor].tolist() == after[sensor].tolist()


def test_fixes_and_readings_do_not_change_one_another() -> None:
    quiet, busy = sensors(), sensors()
    for tick in range(30):
        busy.fix(np.zeros(6))
        assert quiet.readings(tick, DEPUTY, CHIEF) == busy.readings(tick, DEPUTY, CHIEF)
    fresh = sensors()
    fixes = [fresh.fix(np.zeros(6)).tolist() for _ in range(3)]
    late = sensors()
    errors(late, 10)
    assert [late.fix(np.zeros(6)).tolist() for _ in range(3)] == fixes


def test_a_fix_errs_by_what_is_stated_on_every_axis() -> None:
    suite = sensors(fix_position_sigma=2.0, fix_velocity_sigma=0.003)
    truth = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    noise = (np.array([suite.fix(truth) for _ in range(COUNT)]) - truth) / np.repeat([2.0, 0.003], 3)
    assert np.abs(noise.mean(axis=0)).max() < FIVE_SIGMA
    assert np.abs(noise.std(axis=0) - 1.0).max() < FIVE_SIGMA / math.sqrt(2.0)
    assert np.abs(np.corrcoef(noise.T) - np.eye(6)).max() < FIVE_SIGMA


def test_without_noise_the_reading_is_the_truth() -> None:
    silent = sensors(**{f"{sensor.name.lower()}__sigma": 0.0 for sensor in Sensor})
    assert all(not found.any() for found in errors(silent, 20).values())
