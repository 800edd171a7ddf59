"""What the monitors find in flights of two scenarios, and what they leave alone."""

from dataclasses import replace
from math import nan

import pytest

from formation_gnc.records import Measurement

from .conftest import Watch

SCENARIOS = ("leader_follower", "eccentric_leo")
ONSET, TICKS = 905, 1500

scenarios = pytest.mark.parametrize("scenario", SCENARIOS)
pytestmark = pytest.mark.thorough


# Largest delays, in ticks. Readings come every 10 ticks, and the fault begins 5 ticks before one.
FAULTS: dict[str, tuple[str, str, str, int]] = {
    # 4 sigma, of which three count: h = 10 at 1e-3 a flight, so five readings
    "radius off": ("fault: bias, sensor: radius, value: 20.0", "innovation_bias", "radius", 50),
    "radius scaled": ("fault: scale, sensor: radius, factor: 1.00001", "innovation_bias", "radius", 50),
    # 1 sigma after 100 s, and five readings at 2 sigma
    "latitude drifting": ("fault: drift, sensor: latitude, rate: 1.0e-8", "innovation_bias", "latitude", 300),
    # the first frozen reading and three repeats
    "radius frozen": ("fault: freeze, sensor: radius", "frozen_readings", "radius", 35),
    "latitude frozen": ("fault: freeze, sensor: latitude", "frozen_readings", "latitude", 35),
    # ninety readings without a miss: a chance of 1/95 each, so five intervals; told at slow ticks
    "range rate dead": ("fault: dropout, sensor: range_rate", "dropout", "range_rate", 60),
    "range rate noisy": ("fault: noise, sensor: range_rate, factor: 4.0", "innovation_consistency", "", 300),
    # seven seconds of the radial acceleration, which is none twice in the half revolution of J2's swing
    "range rate late": (
        "fault: late, sensor: range_rate, delay: 7.0, told: false",
        "innovation_bias",
        "range_rate",
        700,
    ),
    # five readings at the three deviations that count
    "sensors swapped": ("fault: swap, sensor: radius, other: latitude", "innovation_bias", "latitude", 60),
    # a half to twice the limit at once, and from the first command on
    "thruster stuck on": ("fault: stuck_on, force: [0.1, 0.0, 0.0]", "thrust_response", "x", 5),
    "thrust reversed": ("fault: thrust_scale, factor: [-1.0, -1.0, -1.0]", "thrust_response", "*", 300),
    "force told as none": ("fault: force_zero", "thrust_response", "*", 600),
    "mass told as a hundredth": ("fault: mass_scale, factor: 0.01", "mass", "", 10),
    "mass told tenfold": ("fault: mass_scale, factor: 10.0", "mass", "", 10),
    "chief's ephemeris frozen": ("fault: chief_freeze", "chief_ephemeris", "chief", 15),
    "chief's ephemeris off by 100 m": ("fault: chief_jump, offset: [0.0, 100.0, 0.0]", "chief_ephemeris", "chief", 15),
    # 1 m + 2.2e-4 m/s^2 t^2 is passed after 23 s by a window that begins with it; by one that has begun, later
    "chief's ephemeris drifting": ("fault: chief_drift, rate: [0.0, 0.0, 0.05]", "chief_ephemeris", "chief", 95),
}

# Subjects that are accused after the right one.
ALSO: dict[str, set[str]] = {
    # the error of the rate moves the state, which radius and latitude contradict before the rate is 4 sigma off
    "range rate late": {"radius", "latitude"},
    # each reads what the other measures: both are at fault
    "sensors swapped": {"radius"},
}


@scenarios
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_within_its_delay_and_named(watch: Watch, scenario: str, fault: str) -> None:
    """No monitor fails before, and the one that is to find it accuses the right subject and no other."""
    fields, monitor, subject, delay = FAULTS[fault]
    flight = watch(scenario, ticks=ONSET + delay + 1, onset=ONSET, fault=fields)
    assert all(tick >= ONSET for tick in flight.failed.values()), flight.failed
    accused = {who: tick for (what, who), tick in flight.failed.items() if what == monitor}
    assert accused, flight.failed
    if subject != "*":
        assert 0 <= flight.delay(monitor, subject, ONSET) <= delay
        assert accused[subject] == min(accused.values()), accused
        assert accused.keys() - {subject} <= ALSO.get(fault, set()), "another one is accused too"


@scenarios
def test_readings_that_are_no_numbers_are_missing_ones(watch: Watch, scenario: str) -> None:
    def corrupt(measurement: Measurement, _: int) -> Measurement:
        readings = [replace(each, values=[nan]) if each.sensor == "radius" else each for each in measurement.readings]
        return replace(measurement, readings=readings)

    flight = watch(scenario, ticks=ONSET + 61, onset=ONSET, corrupt=corrupt)
    assert {who for what, who in flight.failed if what == "dropout"} == {"radius"}


@scenarios
def test_a_radius_that_drifts_slowly_is_found_before_much_harm(watch: Watch, scenario: str) -> None:
    """At 1 cm/s a sigma is reached after 500 s, two after 1000 s: by then it is told, the error below 10 m."""
    flight = watch(scenario, ticks=ONSET + 1100, onset=ONSET, fault="fault: drift, sensor: radius, rate: 0.01")
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
