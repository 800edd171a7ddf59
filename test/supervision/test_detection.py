"""What the monitors find in flights of two scenarios, and what they leave alone."""

from dataclasses import replace

import numpy as np
import pytest

from formation_gnc.records import Measurement, Reading

from .conftest import Corrupt, Watch

SCENARIOS = ("leader_follower", "eccentric_leo")
ONSET, TICKS = 905, 1500

scenarios = pytest.mark.parametrize("scenario", SCENARIOS)
pytestmark = pytest.mark.thorough


def of_sensor(measurement: Measurement, sensor: str, values: list[float] | None, added: float = 0.0) -> Measurement:
    """With other values of a sensor's readings, or none of them, or something added to them."""
    readings: list[Reading] = []
    for reading in measurement.readings:
        if reading.sensor != sensor:
            readings.append(reading)
        elif values is not None:
            readings.append(replace(reading, values=values or [each + added for each in reading.values]))
    return replace(measurement, readings=readings)


def biased(sensor: str, bias: float) -> Corrupt:
    return lambda measurement, _: of_sensor(measurement, sensor, [], bias)


def frozen(sensor: str) -> Corrupt:
    kept: list[float] = []

    def corrupt(measurement: Measurement, _: int) -> Measurement:
        for reading in measurement.readings:
            if reading.sensor == sensor and not kept:
                kept.extend(reading.values)
        return of_sensor(measurement, sensor, kept)

    return corrupt


def dead(sensor: str) -> Corrupt:
    return lambda measurement, _: of_sensor(measurement, sensor, None)


def frozen_chief() -> Corrupt:
    kept: list[np.ndarray] = []

    def corrupt(measurement: Measurement, _: int) -> Measurement:
        kept.append(measurement.chief_state)
        return replace(measurement, chief_state=kept[0])

    return corrupt


def drifting_chief(rate: float) -> Corrupt:
    direction = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return lambda measurement, ticks: replace(
        measurement, chief_state=measurement.chief_state + rate * ticks * direction
    )


def told_mass(factor: float) -> Corrupt:
    return lambda measurement, _: replace(measurement, mass=factor * measurement.mass)


# Largest delays, in ticks. Readings come every 10 ticks, and the fault begins 5 ticks before one.
FAULTS: dict[str, tuple[Corrupt, str, str, int]] = {
    # 4 sigma: h = 9.7 at 1e-3 a flight, so four readings as long as the filter does not follow
    "radius off by 20 m": (biased("radius", 20.0), "innovation_bias", "radius", 50),
    "radius not a number": (biased("radius", float("nan")), "dropout", "radius", 60),
    # the first frozen reading and three repeats
    "radius frozen": (frozen("radius"), "frozen_readings", "radius", 35),
    "latitude frozen": (frozen("latitude"), "frozen_readings", "latitude", 35),
    # ninety readings without a miss: a chance of 1/95 each, so five intervals; told at slow ticks
    "range rate dead": (dead("range_rate"), "dropout", "range_rate", 60),
    "chief's ephemeris frozen": (frozen_chief(), "chief_ephemeris", "", 10),
    # 1 m + 2.2e-4 m/s^2 t^2 is passed after 23 s by a window that begins with it; by one that has begun, later
    "chief's ephemeris drifting at 5 cm/s": (drifting_chief(0.05), "chief_ephemeris", "", 95),
    "chief's ephemeris drifting at 1 m/s": (drifting_chief(1.0), "chief_ephemeris", "", 15),
    "mass told tenfold": (told_mass(10.0), "mass", "", 10),
    "mass told as a hundredth": (told_mass(0.01), "mass", "", 10),
}


@scenarios
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_within_its_delay_and_named(watch: Watch, scenario: str, fault: str) -> None:
    corrupt, monitor, subject, delay = FAULTS[fault]
    flight = watch(scenario, ticks=ONSET + delay + 1, onset=ONSET, corrupt=corrupt)
    assert all(tick >= ONSET for tick in flight.failed.values()), flight.failed
    assert 0 <= flight.delay(monitor, subject, ONSET) <= delay
    wrong = {who for what, who in flight.failed if what == monitor} - {subject}
    assert not wrong, "another sensor is accused too"


@scenarios
def test_a_radius_that_drifts_slowly_is_found_before_much_harm(watch: Watch, scenario: str) -> None:
    """At 1 cm/s a sigma is reached after 500 s, two after 1000 s: by then it is told, the error below 10 m."""

    def corrupt(measurement: Measurement, ticks: int) -> Measurement:
        return of_sensor(measurement, "radius", [], 0.01 * ticks)

    flight = watch(scenario, ticks=ONSET + 1100, onset=ONSET, corrupt=corrupt)
    found = [name for name, subject in flight.failed if subject == "radius"]
    assert {"innovation_drift", "innovation_bias"} & set(found)


@scenarios
def test_half_an_orbit_without_a_fault_raises_no_alarm(watch: Watch, scenario: str) -> None:
    assert watch(scenario, ticks=3000).failed == {}


@pytest.mark.slow
@scenarios
@pytest.mark.parametrize("seed", range(2, 7))
def test_whole_flights_without_a_fault_raise_no_alarm(watch: Watch, scenario: str, seed: int) -> None:
    assert watch(scenario, seed).failed == {}
