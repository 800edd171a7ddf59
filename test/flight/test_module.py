"""Parameter changes of a flight module in flight: staged, committed, scheduled, vetoed."""

import json
from array import array
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.common import Orbit
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters, Plan
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
    """A module whose design can fail; keeps a list of its designs and activations."""

    def __init__(self, schedule: tuple[str, ...] = (), **values: Any) -> None:
        self.designed: list[tuple[float, float]] = []
        self.activated: list[tuple[float, float]] = []
        super().__init__("/deputy1/amplifier", Settings(chief=ORBIT, schedule=schedule, **values))

    def design(self, parameters: Settings) -> float:
        self.designed.append((parameters.gain, parameters.lag))
        if parameters.gain * parameters.lag > 10.0:
            raise DesignError(f"gain {parameters.gain:g} is too much at lag {parameters.lag:g}")
        return parameters.gain * parameters.lag

    def on_tick(self) -> float:
        return self.configuration.design

    def activate(self, old: Configuration[Settings, float], new: Configuration[Settings, float]) -> None:
        self.activated.append((old.design, new.design))

    def tick(self, second: float) -> float:
        """The gain in force at a time (s)."""
        self.begin_tick(round(second * NANOSECONDS))
        assert self.configuration.design == self.parameters.gain * self.parameters.lag
        return self.parameters.gain

    def logged(self) -> list[tuple[int, EventKind, str]]:
        return [(event.tick, EventKind(event.kind), event.detail) for event in self.take_events()]


def test_scheduled_change_takes_effect_at_first_tick_from_its_time() -> None:
    module = Amplifier(("{at: 2.5, gain: 2}",))
    assert [module.tick(second) for second in range(5)] == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert module.logged() == [(3, EventKind.PARAMETERS, "gain: 1.0 -> 2.0")]
    assert module.activated == [(1.0, 2.0)]


def test_event_has_stamp_tick_and_node() -> None:
    module = Amplifier(("{at: 3.0, label: b}",))
    module.tick(3.0)
    (event,) = module.take_events()
    assert (event.time, event.tick, event.node) == (3 * NANOSECONDS, 3, "/deputy1/amplifier")
    assert module.take_events() == []


def test_scheduled_changes_are_designed_once_before_the_flight() -> None:
    module = Amplifier(("{at: 4, gain: 3}", "{at: 2, gain: 2, lag: 2}"))
    assert module.designed == [(1.0, 1.0), (2.0, 2.0), (3.0, 2.0)]
    assert [module.tick(second) for second in range(6)] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert len(module.designed) == 3


@given(
    entries=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 10)), max_size=6),
    ticks=st.sets(st.integers(0, 25), min_size=1),
)
def test_latest_due_schedule_entry_holds_at_any_tick(entries: list[tuple[int, int]], ticks: set[int]) -> None:
    module = Amplifier(tuple(f"{{at: {at}, gain: {gain}}}" for at, gain in entries))
    in_order = sorted(entries, key=lambda entry: entry[0])  # stable: of two at one time, the later in the list holds
    for tick in sorted(ticks):
        due = [gain for at, gain in in_order if at <= tick]
        assert module.tick(tick) == (due[-1] if due else 1.0)
    held = [1.0, *(gain for at, gain in in_order if at <= max(ticks))]
    assert len(module.logged()) == sum(old != new for old, new in pairwise(held)), "what changes nothing is no event"


def test_commit_takes_effect_at_next_tick_and_stage_has_none() -> None:
    module = Amplifier()
    module.tick(0)
    staged = module.stage({"gain": 5.0})
    assert module.tick(1) == 1.0
    module.commit(staged)
    assert module.parameters.gain == 1.0
    assert [module.tick(2), module.tick(3)] == [5.0, 5.0]
    assert module.logged() == [(2, EventKind.PARAMETERS, "gain: 1.0 -> 5.0")]
    assert module.activated == [(1.0, 5.0)]


def test_two_changes_before_a_tick_both_hold() -> None:
    module = Amplifier()
    module.commit(module.stage({"gain": 5.0}))
    with pytest.raises(DesignError, match="gain 5 is too much at lag 3"):
        module.stage({"lag": 3.0})  # with what already waits
    module.commit(module.stage({"lag": 2.0, "label": "b"}))
    assert module.tick(0) == 5.0
    assert (module.parameters.lag, module.parameters.label) == (2.0, "b")


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
def test_rejected_change_has_no_effect(changes: dict[str, Any], words: str) -> None:
    module = Amplifier(("{at: 9, gain: 9}",))
    module.commit(module.stage({"label": "b"}))
    before = module.configuration
    with pytest.raises(ConfigurationError) as rejection:
        module.stage(changes)
    assert str(rejection.value).startswith(words)
    assert module.configuration is before
    assert module.tick(1) == 1.0
    assert module.parameters.label == "b"
    assert module.logged() == [(1, EventKind.PARAMETERS, "label: a -> b")]


def test_change_staged_before_a_scheduled_one_keeps_it() -> None:
    module = Amplifier(("{at: 2, gain: 3}",))
    module.tick(1)
    slow = module.stage({"lag": 2.0})
    assert module.tick(2) == 3.0
    module.commit(slow)
    assert module.tick(3) == 3.0
    assert module.parameters.lag == 2.0


def test_scheduled_change_keeps_earlier_committed_change() -> None:
    module = Amplifier(("{at: 2, gain: 3}",))
    module.commit(module.stage({"lag": 2.0}))
    assert [module.tick(1), module.tick(2)] == [1.0, 3.0]
    assert module.parameters.lag == 2.0


def test_scheduled_change_no_longer_allowed_is_rejected_at_its_tick() -> None:
    module = Amplifier(("{at: 2, gain: 6}", "{at: 4, gain: 2}"))
    module.commit(module.stage({"lag": 4.0}))
    assert [module.tick(second) for second in range(6)] == [1.0, 1.0, 1.0, 1.0, 2.0, 2.0]
    assert module.logged() == [
        (0, EventKind.PARAMETERS, "lag: 1.0 -> 4.0"),
        (2, EventKind.REJECTED, "gain 6 is too much at lag 4"),
        (4, EventKind.PARAMETERS, "gain: 1.0 -> 2.0"),
    ]


def test_schedule_set_in_flight_replaces_pending_changes() -> None:
    module = Amplifier(("{at: 2, gain: 2}", "{at: 4, gain: 4}"))
    module.tick(3)
    module.commit(module.stage({"schedule": ["{at: 6, gain: 3}", "{at: 5, lag: 2}"]}))
    assert [module.tick(second) for second in range(4, 8)] == [4.0, 4.0, 3.0, 3.0]  # due at the tick it was committed
    module.commit(module.stage({"schedule": []}))
    assert module.tick(8) == 3.0
    assert [detail for _, _, detail in module.logged()][-2:] == [
        "gain: 4.0 -> 3.0",
        'schedule: ["{at: 6, gain: 3}", "{at: 5, lag: 2}"] -> []',
    ]


def test_schedule_set_in_flight_is_designed_once_and_kept_in_new_run() -> None:
    module = Amplifier(("{at: 2, gain: 2}",))
    module.tick(3)
    # a new schedule may keep past entries; they hold again in the next run only
    module.commit(module.stage({"gain": 1.5}))
    module.tick(4)
    module.commit(module.stage({"schedule": ["{at: 2, gain: 2}", "{at: 6, lag: 3}"]}))
    designed = len(module.designed)
    assert [module.tick(second) for second in (5, 6)] == [1.5, 1.5]
    assert module.parameters.lag == 3.0
    assert len(module.designed) == designed
    assert [module.tick(second) for second in (0, 2, 6)] == [1.5, 2.0, 2.0]
    assert module.parameters.lag == 3.0


def test_schedule_committed_too_late_is_rejected_and_old_one_stays() -> None:
    module = Amplifier(("{at: 9, gain: 9}",))
    module.tick(3)
    with pytest.raises(ConfigurationError, match="must be above 3 s, which is now"):
        module.stage({"schedule": ["{at: 3, gain: 2}"]})
    slow = module.stage({"schedule": ["{at: 5, gain: 2}"]})
    module.tick(4)
    module.commit(slow)
    assert [module.tick(second) for second in (5, 8, 9)] == [1.0, 1.0, 9.0]
    assert [kind for _, kind, _ in module.logged()] == [EventKind.REJECTED, EventKind.PARAMETERS]


@pytest.mark.parametrize(
    ("name", "value", "written"),
    [
        ("gain", 2, "2.0"),
        ("label", "b", '"b"'),
        ("schedule", ['{at: 9, label: "b"}'], r'["{at: 9, label: \"b\"}"]'),
        ("limits", (1.0, 2.5), "[1.0, 2.5]"),
        ("limits", array("d", [1.0, 2.5]), "[1.0, 2.5]"),
        ("limits", array("q", [1, 3]), "[1.0, 3.0]"),
        ("limits", np.array([1.0, 2.5]), "[1.0, 2.5]"),
        ("limits", np.array([1, 3]), "[1.0, 3.0]"),
        ("limits", [np.float32(1.0), np.int64(3)], "[1.0, 3.0]"),
        ("limits", [], "[]"),
        ("limits", np.array([]), "[]"),
        ("gain", np.float64(2.0), "2.0"),
        ("gain", np.int64(2), "2.0"),
    ],
)
def test_event_has_the_changes_as_json(name: str, value: Any, written: str) -> None:
    module = Amplifier()
    old = dump(module.parameters)[name]
    module.commit(module.stage({name: value}))
    module.tick(1)
    (event,) = module.take_events()
    assert event.kind == EventKind.PARAMETERS
    assert event.changes == [ParameterChange(name, to_json(old), written)]
    assert module.stage({name: json.loads(written)}).parameters == module.parameters


@pytest.mark.parametrize(
    "changes",
    [
        {"gain": 1},
        {"limits": array("d", [1.0, 1.0])},
        {"schedule": ["{at: 9, gain: 9}"]},
        {"mass": 100.0},
        {"label": "a", "lag": 1.0},
    ],
)
def test_a_value_that_a_parameter_has_changes_nothing(changes: dict[str, Any]) -> None:
    module = Amplifier(("{at: 9, gain: 9}",))
    module.tick(1)
    designed = list(module.designed)
    module.commit(module.stage(changes))
    module.tick(2)
    assert (module.logged(), module.activated, module.designed) == ([], [], designed)


def test_a_value_is_compared_with_what_waits_for_the_next_tick() -> None:
    module = Amplifier()
    module.commit(module.stage({"gain": 5.0}))
    module.commit(module.stage({"gain": 5.0}))
    module.commit(module.stage({"gain": 1.0}))
    assert module.tick(1) == 1.0
    assert [detail for *_, detail in module.logged()] == ["gain: 1.0 -> 5.0", "gain: 5.0 -> 1.0"]


def test_an_event_has_only_the_parameters_that_changed() -> None:
    module = Amplifier(("{at: 2, gain: 1, lag: 2}",))
    module.tick(2)
    assert [detail for *_, detail in module.logged()] == ["lag: 1.0 -> 2.0"]


def test_time_running_backwards_starts_an_equal_run() -> None:
    module = Amplifier(("{at: 2, gain: 3}",))
    first = [module.tick(second) for second in range(4)]
    logged = module.logged()
    assert [module.tick(second) for second in range(4)] == first == [1.0, 1.0, 3.0, 3.0]
    assert module.logged() == logged


def test_new_run_keeps_committed_changes() -> None:
    module = Amplifier(("{at: 2, gain: 3}",))
    module.tick(3)
    module.commit(module.stage({"label": "b"}))
    module.tick(4)
    module.commit(module.stage({"lag": 2.0}))  # not in effect yet when the new run begins
    assert module.tick(0) == 1.0
    assert (module.parameters.label, module.parameters.lag) == ("b", 2.0)
    assert module.tick(2) == 3.0


def test_new_run_drops_committed_changes_its_schedule_forbids() -> None:
    module = Amplifier(("{at: 2, gain: 6}",))
    assert module.tick(3) == 6.0
    module.commit(module.stage({"gain": 1.0, "lag": 4.0}))
    assert module.tick(4) == 1.0
    module.take_events()
    assert [module.tick(second) for second in (0, 2)] == [1.0, 6.0]
    assert module.parameters.lag == 1.0
    assert module.logged()[0] == (0, EventKind.REJECTED, "gain 6 is too much at lag 4")


def test_repeated_tick_changes_nothing() -> None:
    module = Amplifier(("{at: 2, gain: 3}",))
    assert [module.tick(2), module.tick(2)] == [3.0, 3.0]
    assert len(module.logged()) == 1


class Cautious(Amplifier):
    """Vetoes gain 7 when staged, gain 8 when due, and gain 9 in a plan."""

    def check_staged(self, staged: Configuration[Settings, float]) -> None:
        self.veto(staged, 7.0)

    def check_due(self, time: int, due: Configuration[Settings, float]) -> None:
        self.veto(due, 8.0)

    def check_plan(self, start: Configuration[Settings, float], plan: Plan[Settings, float]) -> None:
        for _, planned in plan:
            self.veto(planned, 9.0)

    @staticmethod
    def veto(configuration: Configuration[Settings, float], gain: float) -> None:
        if configuration.parameters.gain == gain:
            raise ConfigurationError(f"gain {gain:g} is vetoed")


def test_module_vetoes_a_change_when_staged_when_due_or_in_a_plan() -> None:
    module = Cautious(("{at: 1, gain: 7}", "{at: 2, gain: 8}"))
    with pytest.raises(ConfigurationError, match="gain 7 is vetoed"):
        module.stage({"gain": 7.0})
    with pytest.raises(ConfigurationError, match="gain 9 is vetoed"):
        module.stage({"schedule": ["{at: 3, gain: 9}"]})
    with pytest.raises(ConfigurationError, match="gain 9 is vetoed"):
        Cautious(("{at: 3, gain: 9}",))
    module.commit(module.stage({"gain": 8.0}))
    assert [module.tick(second) for second in (0, 1, 2)] == [1.0, 7.0, 7.0]
    assert [(tick, kind) for tick, kind, _ in module.logged()] == [
        (0, EventKind.REJECTED),
        (1, EventKind.PARAMETERS),
        (2, EventKind.REJECTED),
    ]


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
def test_malformed_schedule_entry_is_rejected_with_an_example(entry: str) -> None:
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
def test_forbidden_scheduled_change_is_rejected_before_the_flight(entry: str, words: str) -> None:
    with pytest.raises(ConfigurationError) as rejection:
        Amplifier((entry,))
    assert str(rejection.value).startswith(words)
