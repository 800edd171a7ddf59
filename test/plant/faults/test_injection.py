"""Injected faults in a run: events, changes in flight, a new fault, cost and what the flight software sees."""

from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH
from formation_gnc.messages.conversion import to_cdr
from formation_gnc.parameters import load, parameter
from formation_gnc.plant.faults.fault import Memory
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.plant.faults.sensors import Sample, SensorFault
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.plant.plant import Plant
from formation_gnc.records import WARNINGS, EventKind
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

from .conftest import COMMAND, VALUES, Flight, Fly
from .test_plan import entries, text_of

BIAS = "{at: 10.0, until: 21.0, deputy: deputy1, fault: bias, sensor: radius, value: 20.0}"
STUCK = "{at: 12.5, deputy: deputy2, fault: stuck_on, force: [0.01, 0.0, 0.0], told: false}"
EXAMPLES = {
    "bias": "sensor: radius, value: 20.0",
    "drift": "sensor: latitude, rate: 1.0e-8",
    "freeze": "sensor: range_rate",
    "scale": "sensor: radius, factor: 1.00001",
    "dropout": "sensor: latitude, share: 0.5",
    "noise": "sensor: range_rate, factor: 4.0",
    "outliers": "sensor: radius, share: 0.2",
    "swap": "sensor: radius, other: latitude",
    "late": "sensor: range_rate, delay: 7.0, told: false",
    "stuck_on": "force: [0.01, 0.0, 0.0], axes: [true, false, false]",
    "stuck_off": "axes: [false, true, false]",
    "thrust_scale": "factor: [0.5, 2.0, -1.0]",
    "misalignment": "rotation: [0.0, 0.0, 0.3], told: false",
    "leak": "force: [0.0, 0.0005, 0.0], told: false",
    "slow": "lag: 30.0",
    "mass_scale": "factor: 0.01",
    "force_freeze": "",
    "force_zero": "",
    "chief_freeze": "",
    "chief_drift": "rate: [0.0, 0.05, 0.0]",
    "chief_jump": "offset: [0.0, 100.0, 0.0]",
}


def example(name: str, when: str) -> str:
    return f"{{{when}, deputy: deputy1, fault: {name}{', ' if EXAMPLES[name] else ''}{EXAMPLES[name]}}}"


def said(flight: Flight) -> list[tuple[int, str, str]]:
    assert all(event.node == "/plant" and event.time == event.tick * 1_000_000_000 for event in flight.events)
    return [(event.tick, event.subject, event.detail) for event in flight.events if event.kind == EventKind.FAULT]


def test_begin_and_end_of_a_fault_are_events_with_its_numbers(fly: Fly) -> None:
    assert said(fly(BIAS, STUCK)) == [
        (10, "deputy1", "begins: radius biased by 20 m, until 21 s"),
        (13, "deputy2", "begins: thrusters stuck on: x at 0.01 N, y at 0 N, z at 0 N, not told"),
        (21, "deputy1", "ends: radius biased by 20 m"),
    ]


def test_a_fault_is_no_warning_and_no_input_of_the_flight_software() -> None:
    assert EventKind.FAULT not in WARNINGS
    for row in GRAPH:
        assert topics.EVENTS not in [each.topic for each in (*row.takes, *row.takes_of_before, *row.takes_of_others)]


def test_a_fault_beyond_the_end_of_the_run_does_nothing(fly: Fly) -> None:
    clean, faulty = fly(), fly("{at: 5000.0, deputy: deputy1, fault: dropout, sensor: radius}")
    assert repr(faulty.measurements) == repr(clean.measurements)
    assert said(faulty) == []


@pytest.mark.parametrize("name", FAULTS)
def test_the_same_seed_gives_the_same_bits_with_any_fault(name: str, fly: Fly) -> None:
    one, other = (fly(example(name, "at: 3.0, until: 25.0")) for _ in range(2))
    assert repr((one.measurements, one.truths, one.events)) == repr((other.measurements, other.truths, other.events))


def test_after_a_fault_of_measurements_they_are_as_without_it(fly: Fly) -> None:
    names = [name for name, fault in FAULTS.items() if "told" not in str(fault.__dataclass_fields__.keys())]
    assert len(names) == 14
    faulty, clean = fly(*(example(name, "at: 3.0, until: 15.0") for name in names)), fly()
    for tick in range(15, 30):
        for deputy in ("deputy1", "deputy2"):
            assert repr(faulty.measurements[deputy][tick]) == repr(clean.measurements[deputy][tick])


def test_a_fault_added_in_flight_holds_from_the_next_tick_on(fly: Fly) -> None:
    flight, clean = fly(ticks=15), fly()
    flight.plant.commit(flight.plant.stage({"faults": [BIAS]}))  # should have begun at 10 s
    flight.fly(15, COMMAND)
    assert said(flight) == [
        (15, "deputy1", "begins: radius biased by 20 m, until 21 s"),
        (21, "deputy1", "ends: radius biased by 20 m"),
    ]
    (changed,) = (event for event in flight.events if event.kind == EventKind.PARAMETERS)
    assert (changed.tick, changed.detail) == (15, f'faults: [] -> ["{BIAS}"]')
    assert [each.name for each in changed.changes] == ["faults"]
    for tick, values in clean.readings()["radius"].items():
        biased = 20.0 if 15 <= tick < 21 else 0.0
        assert flight.readings()["radius"][tick] == pytest.approx([values[0] + biased], abs=4e-9)


def test_a_drift_added_late_starts_from_zero(fly: Fly) -> None:
    flight, clean = fly(ticks=15), fly()
    drift = "{at: 2.0, deputy: deputy1, fault: drift, sensor: radius, rate: 1.0}"
    flight.plant.commit(flight.plant.stage({"faults": [drift]}))
    flight.fly(15, COMMAND)
    for tick, values in clean.readings()["radius"].items():
        assert flight.readings()["radius"][tick] == pytest.approx([values[0] + max(tick - 15, 0)], abs=4e-9)


def test_a_fault_left_out_in_flight_ends_and_one_kept_goes_on(fly: Fly) -> None:
    drift = "{at: 2.0, deputy: deputy1, fault: drift, sensor: latitude, rate: 1.0}"
    flight, kept = fly(STUCK, drift, ticks=15), fly(drift)
    flight.plant.commit(flight.plant.stage({"faults": [drift]}))
    flight.fly(15, COMMAND)
    assert said(flight)[-1] == (15, "deputy2", "ends: thrusters stuck on: x at 0.01 N, y at 0 N, z at 0 N, not told")
    assert flight.readings()["latitude"] == kept.readings()["latitude"]
    assert flight.told("applied_force", "deputy2")[15].tolist() == COMMAND.tolist()  # of the tick before, not told
    assert flight.true("applied_force", "deputy2")[15].tolist() == [0.01, 0.0, 0.0]
    assert flight.true("applied_force", "deputy2")[16].tolist() == COMMAND.tolist()


def test_the_last_of_two_changes_in_a_tick_holds(fly: Fly) -> None:
    flight = fly(ticks=11)
    flight.plant.commit(flight.plant.stage({"faults": [STUCK]}))
    flight.plant.commit(flight.plant.stage({"faults": [BIAS]}))
    flight.fly(5, COMMAND)
    assert [each[:2] for each in said(flight)] == [(11, "deputy1")]


def test_setting_the_same_faults_again_changes_nothing(fly: Fly) -> None:
    flight, undisturbed = fly(BIAS, ticks=15), fly(BIAS)
    flight.plant.commit(flight.plant.stage({"faults": [BIAS]}))
    flight.fly(15, COMMAND)
    assert repr((flight.measurements, flight.events)) == repr((undisturbed.measurements, undisturbed.events))


def test_a_change_that_is_not_allowed_changes_nothing(fly: Fly) -> None:
    flight = fly(BIAS, ticks=25)
    over = BIAS.replace("20.0", "30.0")
    for changes, words in (
        ({"faults": [over]}, "until must be above 25 s, which is now"),
        ({"faults": ["{at: 1.0}"]}, "fault: missing"),
        ({"seed": 2}, "parameter seed: cannot change in flight"),
    ):
        with pytest.raises(ConfigurationError, match=words):
            flight.plant.stage(changes)
    assert flight.plant.stage({"faults": [BIAS, STUCK]}).faults == (BIAS, STUCK)  # what is over may be kept
    assert flight.plant.parameters.faults == (BIAS,)


@dataclass(frozen=True, kw_only=True)
class Rounded(SensorFault):
    """Readings are rounded to a step."""

    step: float = parameter(above=0.0, doc="between readings, in the sensor's unit")

    @property
    def words(self) -> str:
        return f"{self.sensor} rounded to {self.step:g} {self.unit}"

    def alter(self, subject: Sample, memory: Memory, elapsed: float) -> None:
        subject.values = [self.step * round(each / self.step) for each in subject.values]


def test_a_fault_is_a_class_and_a_registry_line(fly: Fly, monkeypatch: pytest.MonkeyPatch) -> None:
    from tools.write_reference import parameters_page

    monkeypatch.setitem(FAULTS, "rounded", Rounded)
    faulty, clean = fly("{at: 4.0, deputy: deputy1, fault: rounded, sensor: radius, step: 1000.0}"), fly()
    for tick, (value,) in faulty.readings()["radius"].items():
        (unrounded,) = clean.readings()["radius"][tick]
        assert value == (unrounded if tick < 4 else 1000.0 * round(unrounded / 1000.0))
    assert said(faulty) == [(4, "deputy1", "begins: radius rounded to 1000 m")]
    with pytest.raises(ConfigurationError, match=r"step: 0\.0 is not allowed; it must be above 0"):
        fly("{at: 4.0, deputy: deputy1, fault: rounded, sensor: radius, step: 0.0}")
    assert "| `rounded` | | | | | | Readings are rounded to a step |" in parameters_page()


def is_finite(value: Any) -> bool:
    """Whether all numbers of a record are finite."""
    if is_dataclass(value):
        return all(is_finite(getattr(value, field.name)) for field in fields(value))
    if isinstance(value, list):
        return all(map(is_finite, value))
    return isinstance(value, str) or bool(np.isfinite(value).all())


def fly_scenario(faults: list[str], duration: float, **values: Any) -> list[tuple[str, Any]]:
    records: list[tuple[str, Any]] = []
    plant = {"duration": duration, "faults": faults, **values}
    Run(load_scenario("leader_follower", {"/plant": plant})).fly(lambda topic, record: records.append((topic, record)))
    return records


@pytest.mark.thorough
@pytest.mark.parametrize("told", ["true", "false"])
def test_a_flight_with_every_fault_at_once_has_finite_topics(told: str) -> None:
    entries = [
        example(name, f"at: {20.0 + 10.0 * number}, until: {300.0 + 10.0 * number}").replace(
            "told: false", f"told: {told}"
        )
        for number, name in enumerate(FAULTS)
    ]
    tank = {"deputy1.thrusters.specific_impulse": 200.0, "deputy1.thrusters.dry_mass": 99.9999}
    records = fly_scenario(entries, 700.0, **tank)
    assert [(topic, record) for topic, record in records if not is_finite(record)] == []
    faults = [record.detail for topic, record in records if topic == "/events" and record.kind == EventKind.FAULT]
    assert len(faults) == 2 * len(FAULTS)
    again = fly_scenario(entries, 700.0, **tank)
    assert [to_cdr(record) for _, record in records] == [to_cdr(record) for _, record in again]


@pytest.mark.thorough
def test_a_flight_with_faults_to_come_has_the_bits_of_one_without() -> None:
    later = [example(name, "at: 400.0") for name in FAULTS]
    one, other = fly_scenario(later, 200.0), fly_scenario([], 200.0)
    assert [(topic, to_cdr(record)) for topic, record in one] == [(topic, to_cdr(record)) for topic, record in other]


@pytest.mark.thorough
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.lists(entries(latest=20.0), max_size=5), st.integers(0, 3))
def test_any_valid_faults_leave_the_plant_finite_and_repeatable(planned: list[dict[str, Any]], seed: int) -> None:
    values = VALUES | {"faults": [text_of(each) for each in planned], "seed": seed}
    one, other = (Flight(Plant(load(PlantParameters, values))).fly(25, COMMAND) for _ in range(2))
    for name in values["deputies"]:
        assert all(map(is_finite, one.measurements[name]))
        assert all(map(is_finite, one.truths[name]))
    assert repr((one.measurements, one.truths, one.events)) == repr((other.measurements, other.truths, other.events))
    begun = [event for event in one.events if event.detail.startswith("begins")]
    assert len(begun) == sum(np.ceil(each["at"]) < 25 for each in planned)
