"""The module: commands, faults and events to mode and health."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.mode_records import NO_FORCE, HealthReport, ModeState, RestrictionKind
from formation_gnc.records import EstimateStatus, Event, EventKind, Innovation, ParameterChange, Rejection, Separation
from formation_gnc.supervision.supervisor import Supervisor
from formation_gnc.types import NANOSECONDS, Vector

from .test_monitors import CHIEFS, parameters, records

OFF = np.array([0.0, -250.0, 0.0, 0.0, 0.0, 0.0])


def supervisor(**changes: Any) -> Supervisor:
    return Supervisor("/deputy1/supervisor", parameters(**changes))


def tick(module: Supervisor, number: int, **changes: Any) -> tuple[ModeState, HealthReport | None]:
    """A tick whose measurement, and the records of the tick before, have changes."""
    measurement = records(number, **changes)[0]
    answered = records(number - 1, **changes)[1:] if number > 0 else (None,) * 4
    mode, health = module.on_tick(measurement, *answered)  # type: ignore[arg-type]
    assert mode is not None
    return mode, health


def without(state: ModeState, kind: RestrictionKind) -> list[str]:
    return [each.subject for each in state.restrictions if each.kind == kind]


def changes_of_mode(module: Supervisor) -> list[str]:
    return [f"{each.subject} {each.detail}" for each in module.take_events() if each.kind == EventKind.MODE]


def command(module: Supervisor, mode: str) -> None:
    module.commit(module.stage({"mode": mode}))


def test_the_formation_is_kept_once_the_target_is_reached() -> None:
    module = supervisor()
    assert tick(module, 0)[0].mode == "acquire"
    assert tick(module, 1, estimate={"relative_state": OFF})[0].mode == "acquire"
    state, _ = tick(module, 2)
    assert (state.previous, state.mode, state.reason) == ("acquire", "keep", "target reached")
    assert state.since == 3 * NANOSECONDS
    assert tick(module, 3)[0].mode == "keep"
    assert tick(module, 4, estimate={"relative_state": OFF})[0].mode == "acquire"
    assert module.parameters.mode == "acquire"
    changes = [each.changes for each in module.take_events() if each.kind == EventKind.MODE]
    assert changes == [
        [ParameterChange("mode", '"acquire"', '"keep"')],
        [ParameterChange("mode", '"keep"', '"acquire"')],
    ]


def test_a_command_takes_effect_at_the_next_tick_and_is_an_event() -> None:
    module = supervisor()
    tick(module, 0)
    tick(module, 1)
    command(module, "standby")
    assert tick(module, 2)[0].mode == "standby"
    assert changes_of_mode(module)[-1] == "standby from keep: command standby"
    command(module, "acquire")
    assert tick(module, 3)[0].mode == "acquire"


def test_a_command_that_is_not_allowed_is_refused_with_the_reason() -> None:
    module = supervisor(mode="standby")
    tick(module, 0)
    with pytest.raises(ConfigurationError, match="mode keep: refused in standby; keep begins when"):
        module.stage({"mode": "keep"})


def test_a_scheduled_command_is_refused_at_its_tick() -> None:
    module = supervisor(mode="standby", schedule=("{at: 3.0, mode: keep}",))
    for number in range(5):
        assert tick(module, number)[0].mode == "standby"
    assert any("refused in standby" in each.detail for each in module.take_events())


def test_a_fault_leads_to_safe_and_a_command_out_of_it_once_it_is_over() -> None:
    line = "{monitor: mass, persistence: 1, response: go_to, mode: safe, return: 5}"
    module = supervisor(fault_table=(line,))
    said: list[list[tuple[str, int]]] = []
    tick(module, 0)
    for number in range(1, 12):
        state, health = tick(module, number, measurement={"mass": 1.0})
        said += [] if health is None else [[(each.monitor, each.level) for each in health.statuses]]
    assert state.mode == "safe"
    assert said == [[("mass", 2)]]
    command(module, "acquire")
    assert tick(module, 12, measurement={"mass": 1.0})[0].mode == "safe"
    assert any("overruled by fault safe" in each.detail for each in module.take_events())
    assert module.parameters.mode == "safe"
    for number in range(13, 40):
        assert tick(module, number)[0].mode == "safe"
    command(module, "acquire")
    assert tick(module, 40)[0].mode == "acquire"


def test_a_sensor_at_fault_is_isolated_and_the_last_one_leads_to_safe() -> None:
    module = supervisor()
    for number in range(0, 100):
        readings = [replace(each, values=[7.0]) for each in records(number)[0].readings]  # type: ignore[union-attr]
        state, _ = tick(module, number, measurement={"readings": readings[:1]})
    assert without(state, RestrictionKind.SENSOR) == ["radius"]
    assert state.restrictions[0].reason == "frozen_readings radius"
    assert state.mode == "keep"
    module = supervisor()
    for number in range(0, 100):
        readings = [replace(each, values=[7.0]) for each in records(number)[0].readings]  # type: ignore[union-attr]
        state, _ = tick(module, number, measurement={"readings": readings})
    assert len(without(state, RestrictionKind.SENSOR)) == 2
    assert state.mode == "safe"
    assert state.reason.endswith(": the last sensor")
    command(module, "acquire")
    assert tick(module, 100, measurement={"readings": readings})[0].mode == "safe"


def test_without_an_estimate_there_is_a_mode_nevertheless() -> None:
    module = supervisor()
    tick(module, 0)
    tick(module, 1)
    state, _ = module.on_tick(records(2, measurement={"fix_available": True})[0])  # type: ignore[arg-type]
    assert state is not None
    assert (state.previous, state.mode, state.reason) == ("keep", "acquire", "state lost")


def test_records_of_the_tick_before_are_there_unless_it_was_missed() -> None:
    module = supervisor()
    answered, missed = (records(3, measurement={"fix_available": fix})[0] for fix in (False, True))
    assert module.has_delayed_inputs(answered)  # type: ignore[arg-type]
    assert not module.has_delayed_inputs(missed)  # type: ignore[arg-type]


def test_one_started_again_goes_on_with_the_mode_that_is_obeyed() -> None:
    module = supervisor()
    state, _ = tick(module, 20, status={"mode": "safe"})
    assert (state.previous, state.mode) == ("safe", "safe")
    (adopted,) = [each for each in module.take_events() if each.kind == EventKind.MODE]
    assert adopted.changes == [ParameterChange("mode", '"acquire"', '"safe"')]
    assert module.parameters.mode == "safe"


def test_a_reconfiguration_has_a_mode_of_its_own() -> None:
    module = supervisor()
    modes = [tick(module, number, target={"reconfiguring": 2 < number < 6})[0].mode for number in range(9)]
    assert modes == ["acquire", "keep", "keep", "reconfigure", "reconfigure", "reconfigure", "acquire", "keep", "keep"]


def test_a_fault_is_an_event_once_and_so_is_its_response() -> None:
    module = supervisor()
    for number in range(100):
        readings = [replace(each, values=[7.0]) for each in records(number)[0].readings]  # type: ignore[union-attr]
        tick(module, number, measurement={"readings": readings[:1]})
    events = [(each.kind, each.subject) for each in module.take_events() if each.kind > EventKind.MODE]
    assert events == [(EventKind.DETECTION, "radius"), (EventKind.RESPONSE, "radius")]


def test_switched_off_it_has_modes_and_answers_no_fault() -> None:
    module = supervisor(enabled=False, fault_table=("{monitor: mass, response: go_to, mode: safe}",))
    for number in range(40):
        state, health = tick(module, number, measurement={"mass": 1.0})
        assert health is None or health.statuses == []
    assert state.mode == "keep"
    module.commit(module.stage({"enabled": True}))
    assert [tick(module, number, measurement={"mass": 1.0})[0].mode for number in range(40, 60)][-1] == "safe"


def test_an_earlier_time_is_ignored_unless_it_brings_a_fix() -> None:
    module = supervisor()
    for number in range(30):
        tick(module, number)
    assert module.on_tick(*records(10)) == (None, None)  # type: ignore[arg-type]
    assert module.on_tick(*records(29)) == (None, None)  # type: ignore[arg-type]
    state, _ = tick(module, 0, measurement={"fix_available": True})
    assert (state.time, state.previous) == (0, "acquire")


def test_a_new_run_is_answered_as_the_first_one() -> None:
    module = supervisor(fault_table=("{monitor: mass, response: go_to, mode: safe}",))
    said: list[list[tuple[ModeState, HealthReport | None]]] = []
    forces: list[bytes] = []
    events: list[list[Event]] = []
    for _ in range(2):
        answers = []
        for number in range(60):
            changes = {"fix_available": number == 0, "mass": 1.0 if number > 30 else 100.0}
            answers.append(tick(module, number, measurement=changes))
        forces.append(np.array([state.force for state, _ in answers]).tobytes())
        said.append([(replace(state, force=NO_FORCE), health) for state, health in answers])
        events.append(module.take_events())
    assert said[0] == said[1]
    assert forces[0] == forces[1]
    assert events[0] == events[1]
    assert said[0][-1][0].mode == "safe"


def test_a_new_fault_table_holds_from_its_tick_on() -> None:
    module = supervisor()
    tick(module, 0)
    with pytest.raises(ConfigurationError, match="did you mean mass"):
        module.stage({"fault_table": ["{monitor: masss, response: warn}"]})
    module.commit(module.stage({"fault_table": ["{monitor: mass, response: go_to, mode: standby}"]}))
    for number in range(1, 12):
        state, _ = tick(module, number, measurement={"mass": 1.0})
    assert state.mode == "standby"
    assert state.time == 11 * NANOSECONDS


def test_a_command_ends_what_has_no_return_where_the_fault_is_over() -> None:
    module = supervisor(fault_table=("{monitor: mass, response: go_to, mode: safe, modes: [keep]}",))
    for number in range(40):
        tick(module, number, measurement={"mass": 1.0 if 5 < number < 20 else 100.0})
    module.take_events()
    command(module, "acquire")
    assert [tick(module, number)[0].mode for number in range(40, 43)] == ["acquire", "keep", "keep"]
    assert [each.detail for each in module.take_events() if each.kind == EventKind.RESPONSE] == [
        "ends: mass: go_to safe"
    ]


def test_a_low_separation_is_evaded_until_a_prediction_is_above_it() -> None:
    module = supervisor(least_separation=20.0)
    modes = []
    for number in range(400):
        time, distance = (number - 1) * NANOSECONDS, 10.0 if number < 100 else 500.0
        due = [Separation(time, distance, time, "deputy2", distance, time, "deputy2")] if number % 60 == 1 else []
        modes.append(tick(module, number, target={"separation": due})[0].mode)
    assert modes[1] == "avoid"
    # low until the prediction of tick 120; a return of 60 ticks, and the first prediction after it
    assert {*modes[1:180]} == {"avoid"}
    assert modes[181:183] == ["acquire", "keep"]


def test_what_is_isolated_is_judged_further_and_returns_when_it_is_well() -> None:
    module = supervisor(fault_table=("{monitor: innovation_bias, response: isolate_sensor, return: 100}",))
    isolated = []
    for number in range(1000):
        off = 30.0 if 100 <= number < 500 else 0.0
        rejection = Rejection.ISOLATED if isolated and isolated[-1] else ""
        innovations = [Innovation("radius", [off], [5.0], 0.0, rejection)] if number % 10 == 0 else []
        state, _ = tick(module, number, estimate={"innovations": innovations})
        isolated.append(without(state, RestrictionKind.SENSOR) == ["radius"])
    begin, end = isolated.index(True), len(isolated) - isolated[::-1].index(True)
    assert all(isolated[begin:end])
    assert 100 < begin < 160
    assert 600 < end < 900


def contradict(module: Supervisor, number: int, *sensors: str, chief: Vector = NO_FORCE, **changes: Any) -> ModeState:
    """A tick at which some sensors are far off the state, and the chief is told somewhere else."""
    innovations = [
        replace(each, values=[each.values[0] + 5.0 * (each.sensor in sensors)])
        for each in records(number)[1].innovations  # type: ignore[union-attr]
    ]
    told = CHIEFS[number % len(CHIEFS)] + np.concatenate([chief, NO_FORCE])
    state, _ = tick(module, number, measurement={"chief_state": told}, estimate={"innovations": innovations} | changes)
    return state


def test_a_second_sensor_that_contradicts_the_state_leads_to_safe() -> None:
    """Of three, one is isolated; with a second one accused it may be the motion that is not as told."""
    module = supervisor()
    for number in range(0, 400):
        state = contradict(module, number, "radius", *["latitude"] * (number >= 200))
        if number == 199:
            assert without(state, RestrictionKind.SENSOR) == ["radius"]
            assert state.mode == "keep"
    assert without(state, RestrictionKind.SENSOR) == ["radius", "state"]
    assert state.mode == "safe"
    assert state.reason.endswith("latitude: too few sensors are left to say which are wrong")
    assert not state.force.any()


def test_a_state_begun_anew_gives_the_sensors_back_and_a_way_out() -> None:
    """After a fix nobody is accused, and the way out is found from it."""
    module = supervisor()
    for number in range(0, 400):
        contradict(module, number, "radius", "latitude")
    module.take_events()
    state = contradict(module, 400, status=EstimateStatus.ACQUIRED)
    assert without(state, RestrictionKind.SENSOR) == []
    assert any(each.detail.startswith("state acquired anew; ") for each in module.take_events())
    assert {contradict(module, number, "radius", "latitude").mode for number in range(401, 600)} == {"safe"}


def test_sensors_accused_about_a_wrong_chief_are_given_back() -> None:
    """The ephemeris is what is isolated, and not the sensor that contradicted the state about it."""
    module, off = supervisor(), np.array([0.0, 5000.0, 0.0])
    for number in range(0, 290):
        state = contradict(module, number, "radius")
    assert without(state, RestrictionKind.SENSOR) == ["radius"]
    for number in range(290, 312):
        state = contradict(module, number, chief=off)
    assert without(state, RestrictionKind.SENSOR) == ["chief"]
    assert state.restrictions[0].reason == "chief_ephemeris chief"
