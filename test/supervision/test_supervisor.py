"""The module: commands, faults and events to mode and health."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.records import Event
from formation_gnc.supervision.records import HealthReport, ModeState
from formation_gnc.supervision.supervisor import Supervisor
from formation_gnc.types import NANOSECONDS

from .test_monitors import parameters, records

OFF = np.array([0.0, -250.0, 0.0, 0.0, 0.0, 0.0])


def supervisor(**changes: Any) -> Supervisor:
    return Supervisor("/deputy1/supervisor", parameters(**changes))


def tick(module: Supervisor, number: int, **changes: Any) -> tuple[ModeState, HealthReport]:
    answer = module.on_tick(*records(number, **changes))  # type: ignore[arg-type]
    assert answer is not None
    return answer


def command(module: Supervisor, mode: str) -> None:
    module.commit(module.stage({"mode": mode}))


def test_the_formation_is_kept_once_the_target_is_reached() -> None:
    module = supervisor()
    assert tick(module, 0, estimate={"relative_state": OFF})[0].mode == "acquire"
    state, _ = tick(module, 1)
    assert (state.previous, state.mode, state.reason) == ("acquire", "keep", "target reached")
    assert tick(module, 2)[0].mode == "keep"
    assert tick(module, 3, estimate={"relative_state": OFF})[0].mode == "acquire"
    assert module.parameters.mode == "acquire"


def test_a_command_takes_effect_at_the_next_tick_and_is_an_event() -> None:
    module = supervisor()
    tick(module, 0)
    command(module, "standby")
    assert tick(module, 1)[0].mode == "standby"
    assert any("keep to standby: command standby" in str(each) for each in module.take_events())
    command(module, "acquire")
    assert tick(module, 2)[0].mode == "acquire"


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
    tick(module, 0)
    for number in range(1, 12):
        state, health = tick(module, number, measurement={"mass": 1.0})
    assert state.mode == "safe"
    assert [(each.monitor, each.level) for each in health.statuses] == [("mass", 2)]
    command(module, "acquire")
    assert tick(module, 12, measurement={"mass": 1.0})[0].mode == "safe"
    assert any("overruled by fault safe" in each.detail for each in module.take_events())
    assert module.parameters.mode == "safe"
    for number in range(13, 40):
        assert tick(module, number)[0].mode == "safe"
    command(module, "acquire")
    assert tick(module, 40)[0].mode == "acquire"


def test_a_sensor_with_a_fault_is_isolated_and_the_last_one_never() -> None:
    module = supervisor()
    for number in range(0, 100):
        readings = [replace(each, values=[7.0]) for each in records(number)[0].readings]  # type: ignore[union-attr]
        _, health = tick(module, number, measurement={"readings": readings[:1]})
    assert health.isolated_sensors == ["radius"]
    module = supervisor()
    for number in range(0, 100):
        readings = [replace(each, values=[7.0]) for each in records(number)[0].readings]  # type: ignore[union-attr]
        _, health = tick(module, number, measurement={"readings": readings})
    assert len(health.isolated_sensors) == 2


def test_without_an_estimate_there_is_a_mode_nevertheless() -> None:
    module = supervisor()
    tick(module, 0)
    state, _ = module.on_tick(records(1)[0]) or (None, None)  # type: ignore[arg-type]
    assert state is not None
    assert (state.mode, state.reason) == ("acquire", "state lost")


def test_an_earlier_time_is_ignored_unless_it_brings_a_fix() -> None:
    module = supervisor()
    for number in range(30):
        tick(module, number)
    assert module.on_tick(*records(10)) is None  # type: ignore[arg-type]
    assert module.on_tick(*records(29)) is None  # type: ignore[arg-type]
    state, _ = tick(module, 0, measurement={"fix_available": True}, estimate={"relative_state": OFF})
    assert (state.time, state.previous) == (0, "acquire")


def test_a_new_run_is_answered_as_the_first_one() -> None:
    module = supervisor(fault_table=("{monitor: mass, response: go_to, mode: safe}",))
    said: list[list[tuple[ModeState, HealthReport]]] = []
    events: list[list[Event]] = []
    for _ in range(2):
        answers = []
        for number in range(60):
            changes = {"fix_available": number == 0, "mass": 1.0 if number > 30 else 100.0}
            answers.append(tick(module, number, measurement=changes))
        said.append(answers)
        events.append(module.take_events())
    assert said[0] == said[1]
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
