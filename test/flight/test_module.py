import json
from array import array
from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.common import Orbit
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters
from formation_gnc.parameters import dump, parameter, to_json
from formation_gnc.records import EventKind, ParameterChange
from formation_gnc.types import NANOSECONDS

ORBIT = Orbit(7e6)


@dataclass(frozen=True, kw_only=True)
class Settings(ModuleParameters):
    gain: float = parameter(1.0, minimum=0.0, in_flight=True, doc="gain")
    lag: float = parameter(1.0, minimum=0.0, in_flight=True, doc="lag; no design for gain times lag above 10")
    label: str = parameter("a", choices=("a", "b"), in_flight=True, doc="label")
    limits: tuple[float, ...] = parameter((1.0, 1.0), in_flight=True, doc="limits")
    mass: float = parameter(100.0, above=0.0, doc="mass")


class Amplifier(FlightModule[Settings, float]):
    """A part whose design can fail, and that keeps a list of what was designed and of who took over."""

    def __init__(self, schedule: tuple[str, ...] = (), **values: Any) -> None:
        self.designed: list[tuple[float, float]] = []
        self.taken_over: list[tuple[float, float]] = []
        super().__init__("/deputy1/amplifier", Settings(chief=ORBIT, schedule=schedule, **values))

    def design(self, parameters: Settings) -> float:
        self.designed.append((parameters.gain, parameters.lag))
        if parameters.gain * parameters.lag > 10.0:
            raise DesignError(f"gain {parameters.gain:g} is too much at lag {parameters.lag:g}")
        return parameters.gain * parameters.lag

    def on_tick(self) -> float:
        return self.configuration.design

    def activate(self, old: Configuration[Settings, float], new: Configuration[Settings, float]) -> None:
        self.taken_over.append((old.design, new.design))

    def tick(self, second: float) -> float:
        """The gain that flies at a time in s."""
        self.begin_tick(round(second * NANOSECONDS))
        assert self.configuration.design == self.parameters.gain * self.parameters.lag
        return self.parameters.gain

    def logged(self) -> list[tuple[int, EventKind, str]]:
        return [(event.tick, EventKind(event.kind), event.detail) for event in self.take_events()]


def test_a_scheduled_change_takes_over_at_the_first_tick_from_its_time_on() -> None:
    part = Amplifier(("{at: 2.5, gain: 2}",))
    assert [part.tick(second) for second in range(5)] == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert part.logged() == [(3, EventKind.PARAMETERS, "gain: 1.0 -> 2.0")]
    assert part.taken_over == [(1.0, 2.0)]


def test_an_event_says_when_and_whom_it_happened_to() -> None:
    part = Amplifier(("{at: 3.0, label: b}",))
    part.tick(3.0)
    (event,) = part.take_events()
    assert (event.time, event.tick, event.node) == (3 * NANOSECONDS, 3, "/deputy1/amplifier")
    assert part.take_events() == []


def test_scheduled_changes_are_designed_before_the_flight_and_not_again_in_it() -> None:
    part = Amplifier(("{at: 4, gain: 3}", "{at: 2, gain: 2, lag: 2}"))
    assert part.designed == [(1.0, 1.0), (2.0, 2.0), (3.0, 2.0)]
    assert [part.tick(second) for second in range(6)] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert len(part.designed) == 3


@given(
    entries=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 10)), max_size=6),
    ticks=st.sets(st.integers(0, 25), min_size=1),
)
def test_whatever_ticks_are_flown_the_latest_due_entry_of_the_schedule_holds(
    entries: list[tuple[int, int]], ticks: set[int]
) -> None:
    part = Amplifier(tuple(f"{{at: {at}, gain: {gain}}}" for at, gain in entries))
    in_order = sorted(entries, key=lambda entry: entry[0])  # stable: of two at one time the later in the list
    for tick in sorted(ticks):
        due = [gain for at, gain in in_order if at <= tick]
        assert part.tick(tick) == (due[-1] if due else 1.0)
    assert len(part.logged()) == sum(at <= max(ticks) for at, _ in entries)


def test_what_is_prepared_has_no_effect_and_what_is_adopted_has_it_at_the_next_tick() -> None:
    part = Amplifier()
    part.tick(0)
    prepared = part.stage({"gain": 5.0})
    assert part.tick(1) == 1.0
    part.commit(prepared)
    assert part.parameters.gain == 1.0
    assert [part.tick(2), part.tick(3)] == [5.0, 5.0]
    assert part.logged() == [(2, EventKind.PARAMETERS, "gain: 1.0 -> 5.0")]
    assert part.taken_over == [(1.0, 5.0)]


def test_two_changes_before_a_tick_both_hold() -> None:
    part = Amplifier()
    part.commit(part.stage({"gain": 5.0}))
    with pytest.raises(DesignError, match="gain 5 is too much at lag 3"):
        part.stage({"lag": 3.0})  # with what already waits
    part.commit(part.stage({"lag": 2.0, "label": "b"}))
    assert part.tick(0) == 5.0
    assert (part.parameters.lag, part.parameters.label) == (2.0, "b")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gain": -1.0}, "parameter gain: -1.0 is not allowed; it must be at least 0"),
        ({"gain": float("nan")}, "parameter gain: nan is not allowed; it must be finite"),
        ({"gain": 11.0}, "gain 11 is too much at lag 1"),
        ({"gain": 2.0, "mass": 1.0}, "parameter mass: cannot change in flight; set it at the start"),
        ({"gain": 2.0, "gian": 2.0}, "parameter gian: unknown; did you mean gain?"),
        ({"schedule": ["{at: 5, gain: 11}"]}, "gain 11 is too much at lag 1"),
        (
            {"schedule": ["{at: 0, gain: 2}"]},
            "parameter schedule: '{at: 0, gain: 2}' is not allowed; its time must be above 0 s, which is now",
        ),
        ({"tick": 2.0}, "parameter tick: cannot change in flight"),
    ],
)
def test_a_rejected_change_leaves_everything_as_it_was(changes: dict[str, Any], words: str) -> None:
    part = Amplifier(("{at: 9, gain: 9}",))
    part.commit(part.stage({"label": "b"}))
    before = part.configuration
    with pytest.raises(ConfigurationError) as rejection:
        part.stage(changes)
    assert str(rejection.value).startswith(words)
    assert part.configuration is before
    assert part.tick(1) == 1.0
    assert part.parameters.label == "b"
    assert part.logged() == [(1, EventKind.PARAMETERS, "label: a -> b")]


def test_a_change_prepared_before_a_scheduled_one_does_not_undo_it() -> None:
    part = Amplifier(("{at: 2, gain: 3}",))
    part.tick(1)
    slow = part.stage({"lag": 2.0})
    assert part.tick(2) == 3.0
    part.commit(slow)
    assert part.tick(3) == 3.0
    assert part.parameters.lag == 2.0


def test_a_scheduled_change_keeps_what_was_adopted_before_it() -> None:
    part = Amplifier(("{at: 2, gain: 3}",))
    part.commit(part.stage({"lag": 2.0}))
    assert [part.tick(1), part.tick(2)] == [1.0, 3.0]
    assert part.parameters.lag == 2.0


def test_a_scheduled_change_that_no_longer_fits_is_rejected_at_its_tick_and_the_flight_goes_on() -> None:
    part = Amplifier(("{at: 2, gain: 6}", "{at: 4, gain: 2}"))
    part.commit(part.stage({"lag": 4.0}))
    assert [part.tick(second) for second in range(6)] == [1.0, 1.0, 1.0, 1.0, 2.0, 2.0]
    assert part.logged() == [
        (0, EventKind.PARAMETERS, "lag: 1.0 -> 4.0"),
        (2, EventKind.REJECTED, "gain 6 is too much at lag 4"),
        (4, EventKind.PARAMETERS, "gain: 1.0 -> 2.0"),
    ]


def test_a_schedule_set_in_flight_takes_the_place_of_what_was_to_come() -> None:
    part = Amplifier(("{at: 2, gain: 2}", "{at: 4, gain: 4}"))
    part.tick(3)
    part.commit(part.stage({"schedule": ["{at: 6, gain: 3}", "{at: 5, lag: 2}"]}))
    assert [part.tick(second) for second in range(4, 8)] == [4.0, 4.0, 3.0, 3.0]  # due in the tick it came
    part.commit(part.stage({"schedule": []}))
    assert part.tick(8) == 3.0
    assert [detail for _, _, detail in part.logged()][-2:] == [
        "gain: 4.0 -> 3.0",
        'schedule: ["{at: 6, gain: 3}", "{at: 5, lag: 2}"] -> []',
    ]


def test_a_schedule_set_in_flight_is_designed_once_and_flown_in_every_new_run() -> None:
    part = Amplifier(("{at: 2, gain: 2}",))
    part.tick(3)
    # what is over may stay in it, for a new run; it is not flown again in this one
    part.commit(part.stage({"gain": 1.5}))
    part.tick(4)
    part.commit(part.stage({"schedule": ["{at: 2, gain: 2}", "{at: 6, lag: 3}"]}))
    designed = len(part.designed)
    assert [part.tick(second) for second in (5, 6)] == [1.5, 1.5]
    assert part.parameters.lag == 3.0
    assert len(part.designed) == designed
    assert [part.tick(second) for second in (0, 2, 6)] == [1.5, 2.0, 2.0]
    assert part.parameters.lag == 3.0


def test_a_schedule_that_comes_too_late_is_rejected_at_its_tick_and_the_old_one_stays() -> None:
    part = Amplifier(("{at: 9, gain: 9}",))
    part.tick(3)
    with pytest.raises(ConfigurationError, match="must be above 3 s, which is now"):
        part.stage({"schedule": ["{at: 3, gain: 2}"]})
    slow = part.stage({"schedule": ["{at: 5, gain: 2}"]})
    part.tick(4)
    part.commit(slow)
    assert [part.tick(second) for second in (5, 8, 9)] == [1.0, 1.0, 9.0]
    assert [kind for _, kind, _ in part.logged()] == [EventKind.REJECTED, EventKind.PARAMETERS]


@pytest.mark.parametrize(
    ("name", "value", "written"),
    [
        ("gain", 2, "2.0"),
        ("label", "b", '"b"'),
        ("schedule", ['{at: 9, label: "b"}'], r'["{at: 9, label: \"b\"}"]'),
        ("limits", (1.0, 2.5), "[1.0, 2.5]"),
        ("limits", array("d", [1.0, 2.5]), "[1.0, 2.5]"),
    ],
)
def test_an_event_has_the_changes_as_json(name: str, value: Any, written: str) -> None:
    part = Amplifier()
    old = dump(part.parameters)[name]
    part.commit(part.stage({name: value}))
    part.tick(1)
    (event,) = part.take_events()
    assert event.kind == EventKind.PARAMETERS
    assert event.changes == [ParameterChange(name, to_json(old), written)]
    assert part.stage({name: json.loads(written)}).parameters == part.parameters


def test_time_that_runs_backwards_is_a_new_run_from_the_same_start() -> None:
    part = Amplifier(("{at: 2, gain: 3}",))
    first = [part.tick(second) for second in range(4)]
    told = part.logged()
    assert [part.tick(second) for second in range(4)] == first == [1.0, 1.0, 3.0, 3.0]
    assert part.logged() == told


def test_a_new_run_keeps_what_was_adopted_in_the_one_before() -> None:
    part = Amplifier(("{at: 2, gain: 3}",))
    part.tick(3)
    part.commit(part.stage({"label": "b"}))
    part.tick(4)
    part.commit(part.stage({"lag": 2.0}))  # still waits when the new run begins
    assert part.tick(0) == 1.0
    assert (part.parameters.label, part.parameters.lag) == ("b", 2.0)
    assert part.tick(2) == 3.0


def test_a_new_run_drops_what_was_adopted_where_its_schedule_does_not_go_with_that() -> None:
    part = Amplifier(("{at: 2, gain: 6}",))
    assert part.tick(3) == 6.0
    part.commit(part.stage({"gain": 1.0, "lag": 4.0}))
    assert part.tick(4) == 1.0
    part.take_events()
    assert [part.tick(second) for second in (0, 2)] == [1.0, 6.0]
    assert part.parameters.lag == 1.0
    assert part.logged()[0] == (0, EventKind.REJECTED, "gain 6 is too much at lag 4")


def test_the_same_tick_again_changes_nothing() -> None:
    part = Amplifier(("{at: 2, gain: 3}",))
    assert [part.tick(2), part.tick(2)] == [3.0, 3.0]
    assert len(part.logged()) == 1


@pytest.mark.parametrize(
    "entry",
    [
        "coast",
        "",
        "{gain: 2}",
        "{at: soon, gain: 2}",
        "{at: .nan, gain: 2}",
        "{at: .inf, gain: 2}",
        "{at: [1], gain: 2}",
        "[at, 1]",
        "{at: 1, gain: 2",
    ],
)
def test_an_entry_of_the_schedule_that_makes_no_sense_is_rejected_with_an_example(entry: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        Amplifier((entry,))
    assert str(rejection.value) == (
        f"parameter schedule: {entry!r} is not allowed; "
        "it must be like '{at: 3000.0, algorithm: coast}' with the time in seconds"
    )


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{at: 1, gain: -1}", "parameter gain: -1.0 is not allowed"),
        ("{at: 1, gain: 11}", "gain 11 is too much at lag 1"),
        ("{at: 1, mass: 5}", "parameter mass: cannot change in flight"),
        ("{at: 1, 5: 5}", "parameter 5: unknown"),
        ("{at: 1, schedule: []}", "parameter schedule: '{at: 1, schedule: []}' is not allowed"),
    ],
)
def test_a_scheduled_change_that_is_not_allowed_is_rejected_before_the_flight(entry: str, words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        Amplifier((entry,))
    assert str(rejection.value).startswith(words)
