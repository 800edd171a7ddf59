"""Faults of sensors: readings against those of the same flight without the fault, same seed."""

from collections.abc import Iterator

import numpy as np
import pytest

from formation_gnc.plant.faults.fault import Memory
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.plant.faults.sensors import Bias, Drift, Sample, SensorFault
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import NANOSECONDS

from .conftest import Flight, Fly, differences

BEGIN, END = 10, 21
WHEN = f"at: {BEGIN}.0, until: {END}.0, deputy: deputy1"
ROUNDING = 4e-9  # m; a unit in the last place of a radius of 7e6 m is 9e-10
FIELDS = {
    "bias": "value: 20.0",
    "drift": "rate: 0.5",
    "freeze": "",
    "scale": "factor: 1.25",
    "dropout": "",
    "noise": "factor: 3.0",
    "outliers": "share: 1.0",
    "swap": "other: latitude",
    "late": "delay: 3.0",
}
"""Of one entry of each fault of a sensor."""


def entry(name: str, sensor: str = "radius", fields: str | None = None) -> str:
    more = FIELDS[name] if fields is None else fields
    return f"{{{WHEN}, fault: {name}, sensor: {sensor}{', ' if more else ''}{more}}}"


def bits(flight: Flight, sensor: str, deputy: str = "deputy1") -> list[tuple[int, list[str]]]:
    return [(tick, [each.hex() for each in of]) for tick, of in flight.readings(deputy).get(sensor, {}).items()]


def inside(found: dict[int, np.ndarray]) -> Iterator[tuple[int, float]]:
    """Ticks and differences within the fault; those outside are zero, to the bit."""
    assert len(found) == 15
    for tick, (difference,) in found.items():
        if BEGIN <= tick < END:
            yield tick, difference
        else:
            assert difference == 0.0


def test_every_fault_of_a_sensor_has_an_example() -> None:
    assert FIELDS.keys() == {name for name, fault in FAULTS.items() if issubclass(fault, SensorFault)}


@pytest.mark.parametrize("name", FIELDS)
def test_a_fault_changes_no_other_sensor_deputy_or_truth(name: str, fly: Fly) -> None:
    clean, faulty = fly(), fly(entry(name))
    others = {"range_rate", *(() if name == "swap" else ("latitude",))}
    for sensor in others:
        assert bits(faulty, sensor) == bits(clean, sensor)
    for sensor in sensors():
        assert bits(faulty, sensor, "deputy2") == bits(clean, sensor, "deputy2")
    for tick, (one, other) in enumerate(zip(faulty.truths["deputy1"], clean.truths["deputy1"], strict=True)):
        assert one.inertial_state.tobytes() == other.inertial_state.tobytes(), tick
    for one, other in zip(faulty.measurements["deputy1"], clean.measurements["deputy1"], strict=True):
        assert repr((one.fix, one.chief_state, one.applied_force, one.mass)) == repr(
            (other.fix, other.chief_state, other.applied_force, other.mass)
        )


def test_bias_is_added(fly: Fly) -> None:
    found = dict(inside(differences(fly(entry("bias")), fly(), "radius")))
    assert list(found) == [10, 12, 14, 16, 18, 20]
    assert list(found.values()) == pytest.approx([20.0] * 6, abs=ROUNDING)


def test_drift_grows_with_the_time_since_it_began(fly: Fly) -> None:
    for tick, difference in inside(differences(fly(entry("drift")), fly(), "radius")):
        assert difference == pytest.approx(0.5 * (tick - BEGIN), abs=ROUNDING)


def test_scale_multiplies_the_reading(fly: Fly) -> None:
    clean = fly()
    for tick, difference in inside(differences(fly(entry("scale")), clean, "radius")):
        assert difference == pytest.approx(0.25 * clean.readings()["radius"][tick][0], abs=ROUNDING)


def test_a_frozen_sensor_repeats_its_last_reading(fly: Fly) -> None:
    clean, faulty = fly().readings()["radius"], fly(entry("freeze")).readings()["radius"]
    assert [faulty[tick] for tick in range(BEGIN, END, 2)] == [clean[BEGIN - 2]] * 6
    assert {tick: of for tick, of in faulty.items() if not BEGIN <= tick < END} == {
        tick: of for tick, of in clean.items() if not BEGIN <= tick < END
    }


def test_a_sensor_frozen_from_the_start_repeats_its_first_reading(fly: Fly) -> None:
    faulty = fly("{at: 0.0, deputy: deputy1, fault: freeze, sensor: radius}").readings()["radius"]
    assert list(faulty.values()) == [fly().readings()["radius"][0]] * 15


def test_a_dead_sensor_gives_nothing(fly: Fly) -> None:
    clean, faulty = fly().readings()["radius"], fly(entry("dropout")).readings()["radius"]
    assert faulty == {tick: of for tick, of in clean.items() if not BEGIN <= tick < END}


def test_a_share_of_readings_is_lost_and_the_rest_unchanged(fly: Fly) -> None:
    lossy = "{at: 0.0, deputy: deputy1, fault: dropout, sensor: radius, share: 0.3}"
    clean, faulty = fly(ticks=4000).readings()["radius"], fly(lossy, ticks=4000).readings()["radius"]
    assert faulty.items() <= clean.items()
    # 2000 readings: the share is known to 0.0102; four of these
    assert 1.0 - len(faulty) / len(clean) == pytest.approx(0.3, abs=0.041)


def test_noise_is_multiplied(fly: Fly) -> None:
    clean = fly()
    for tick, difference in inside(differences(fly(entry("noise")), clean, "radius")):
        truth = np.linalg.norm(clean.true("inertial_state")[tick][:3])
        noise = clean.readings()["radius"][tick][0] - truth
        assert abs(noise) > 1e-3
        assert difference == pytest.approx(2.0 * noise, abs=ROUNDING)


def test_noise_times_zero_is_the_truth(fly: Fly) -> None:
    silent = fly(entry("noise", fields="factor: 0.0"))
    for tick in range(BEGIN, END, 2):
        truth = np.linalg.norm(silent.true("inertial_state")[tick][:3])
        assert silent.readings()["radius"][tick][0] == pytest.approx(truth, abs=ROUNDING)


def test_outliers_err_by_their_size_to_either_side(fly: Fly) -> None:
    wild = "{at: 0.0, deputy: deputy1, fault: outliers, sensor: radius, share: 0.25, size: 40.0}"
    found = differences(fly(wild, ticks=4000), fly(ticks=4000), "radius")
    errors = np.array([difference[0] for difference in found.values() if difference.any()])
    assert np.abs(errors) == pytest.approx(200.0, abs=ROUNDING)  # 40 times the default 5 m
    # 2000 readings, share known to 0.0097, of 500 outliers the side to 0.022; four of these
    assert len(errors) / len(found) == pytest.approx(0.25, abs=0.039)
    assert np.mean(errors > 0.0) == pytest.approx(0.5, abs=0.09)


def test_swapped_sensors_exchange_their_values(fly: Fly) -> None:
    clean, faulty = fly().readings(), fly(entry("swap")).readings()
    for sensor, other in (("radius", "latitude"), ("latitude", "radius")):
        assert faulty[sensor] == {tick: clean[other if BEGIN <= tick < END else sensor][tick] for tick in clean[sensor]}


def test_sensors_of_different_intervals_are_swapped_with_their_times(fly: Fly) -> None:
    slow = {"deputy1.sensors.latitude.interval": 3.0}
    clean, faulty = fly(values=slow).readings(), fly(entry("swap"), values=slow).readings()
    during = {tick: of for tick, of in faulty["radius"].items() if BEGIN <= tick < END}
    assert during == {tick: clean["latitude"][tick] for tick in (12, 15, 18)}


def test_two_swaps_follow_one_another_in_the_order_given(fly: Fly) -> None:
    clean = fly().readings()
    cycle = fly(entry("swap"), entry("swap", "latitude", "other: range_rate")).readings()
    # radius goes out as latitude, and this as range rate
    assert (cycle["range_rate"][BEGIN], cycle["radius"][BEGIN], cycle["latitude"][BEGIN]) == (
        clean["radius"][BEGIN],
        clean["latitude"][BEGIN],
        clean["range_rate"][BEGIN],
    )


@pytest.mark.parametrize(("told", "age"), [("true", 3), ("false", 0)])
def test_late_readings_come_with_their_age_or_as_if_new(told: str, age: int, fly: Fly) -> None:
    faulty, clean = fly(entry("late", fields=f"delay: 3.0, told: {told}")), fly().readings()["radius"]
    late = [(tick + 3, clean[tick], age * NANOSECONDS) for tick in range(BEGIN, END, 2)]
    timely = [(tick, of, 0) for tick, of in clean.items() if not BEGIN <= tick < END]
    found = [
        (tick, reading.values, reading.age)
        for tick, measurement in enumerate(faulty.measurements["deputy1"])
        for reading in measurement.readings
        if reading.sensor == "radius"
    ]
    assert found == sorted(late + timely, key=lambda each: each[0])


def test_readings_late_by_different_times_may_arrive_at_once(fly: Fly) -> None:
    later = "{at: 12.0, until: 13.0, deputy: deputy1, fault: late, sensor: radius, delay: 4.0}"
    faulty, clean = fly(later), fly().readings()["radius"]
    at_once = [each.values for each in faulty.measurements["deputy1"][16].readings if each.sensor == "radius"]
    assert at_once == [clean[12], clean[16]]


def test_the_latency_of_the_sensor_comes_first(fly: Fly) -> None:
    latent = {"deputy1.sensors.radius.latency": 5.0}
    (late,) = (
        each
        for each in fly(entry("late"), values=latent).measurements["deputy1"][BEGIN + 8].readings
        if each.sensor == "radius"
    )
    assert (late.values, late.age) == (fly().readings()["radius"][BEGIN], 8 * NANOSECONDS)


def test_faults_of_one_sensor_act_in_the_order_given(fly: Fly) -> None:
    clean = fly().readings()["radius"][BEGIN][0]
    biased_first = fly(entry("bias"), entry("scale")).readings()["radius"][BEGIN][0]
    scaled_first = fly(entry("scale"), entry("bias")).readings()["radius"][BEGIN][0]
    twice = fly(entry("bias"), entry("bias")).readings()["radius"][BEGIN][0]
    assert biased_first == pytest.approx(1.25 * (clean + 20.0), abs=ROUNDING)
    assert scaled_first == pytest.approx(1.25 * clean + 20.0, abs=ROUNDING)
    assert twice == pytest.approx(clean + 40.0, abs=ROUNDING)


def test_a_bias_is_frozen_with_the_reading_or_added_to_it_once(fly: Fly) -> None:
    clean, early = fly().readings()["radius"], "{at: 0.0, deputy: deputy1, fault: bias, sensor: radius, value: 20.0}"
    for faults in ((early, entry("freeze")), (entry("freeze"), early)):
        faulty = fly(*faults).readings()["radius"]
        for tick in range(BEGIN, END, 2):
            assert faulty[tick][0] == pytest.approx(clean[BEGIN - 2][0] + 20.0, abs=ROUNDING)


def test_two_random_faults_of_one_sensor_draw_independently(fly: Fly) -> None:
    lossy = "{at: 0.0, deputy: deputy1, fault: dropout, sensor: radius, share: 0.5}"
    kept = len(fly(lossy, lossy, ticks=4000).readings()["radius"]) / 2000
    assert kept == pytest.approx(0.25, abs=0.039)  # four deviations of 0.0097; a half if they were the same


def test_what_is_random_is_so_by_the_seed_whatever_else_fails(fly: Fly) -> None:
    wild = "{at: 0.0, deputy: deputy1, fault: outliers, sensor: radius, share: 0.5}"
    other = "{at: 0.0, deputy: deputy1, fault: outliers, sensor: latitude, share: 0.5}"
    assert bits(fly(wild), "radius") == bits(fly(wild), "radius") == bits(fly(other, wild), "radius")
    pattern = [bool(each.any()) for each in differences(fly(wild, ticks=200), fly(ticks=200), "radius").values()]
    seed = {"seed": 2}
    reseeded = differences(fly(wild, ticks=200, values=seed), fly(ticks=200, values=seed), "radius")
    assert pattern != [bool(each.any()) for each in reseeded.values()]


@pytest.mark.parametrize(("value", "expected"), [((5.0,), [6.0, 7.0, 8.0]), ((1.0, 2.0, 3.0), [2.0, 4.0, 6.0])])
def test_a_reading_of_several_values_has_one_error_or_one_for_each(
    value: tuple[float, ...], expected: list[float]
) -> None:
    sample = Sample("radius", [1.0, 2.0, 3.0], [0.0] * 3, [1.0] * 3, 0)
    memory = Memory(np.random.default_rng(1))
    Bias(at=0.0, deputy="deputy1", sensor="radius", value=value).alter(sample, memory, 0.0)
    assert sample.values == expected
    Drift(at=0.0, deputy="deputy1", sensor="radius", rate=value).alter(sample, memory, 0.0)
    assert sample.values == expected
