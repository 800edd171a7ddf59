"""The mode machine, explored exhaustively."""

from itertools import combinations, product

import pytest

from formation_gnc.supervision.modes import (
    COMMANDS,
    FAULTS,
    PRIORITY,
    REFUSALS,
    TRANSITIONS,
    Mode,
    Trigger,
    diagram,
    refusal,
    step,
    table,
)

modes = pytest.mark.parametrize("mode", Mode)


def test_every_trigger_has_one_rank() -> None:
    assert len(PRIORITY) == len(Trigger)
    assert set(PRIORITY) == set(Trigger)


def test_every_command_is_either_carried_out_or_refused_with_a_reason() -> None:
    for key in product(Mode, COMMANDS.values()):
        assert (key in TRANSITIONS) != (key in REFUSALS), key
    assert all(REFUSALS.values())
    assert {trigger for _, trigger in REFUSALS} <= set(COMMANDS.values())


@modes
def test_every_single_trigger_does_what_the_table_says(mode: Mode) -> None:
    for trigger in Trigger:
        found = step(mode, [trigger])
        assert found.mode == TRANSITIONS.get((mode, trigger), mode)
        assert found.trigger == (trigger if (mode, trigger) in TRANSITIONS else None)
        assert [each for each, _ in found.refusals] == ([trigger] if (mode, trigger) in REFUSALS else [])


@modes
def test_of_every_pair_the_safer_trigger_decides_in_any_order(mode: Mode) -> None:
    for pair in combinations(Trigger, 2):
        found = step(mode, pair)
        assert found == step(mode, pair[::-1])
        rows = [each for each in pair if (mode, each) in TRANSITIONS]
        decisive = min(rows, key=PRIORITY.index) if rows else None
        assert found.trigger == decisive
        assert found.mode == (TRANSITIONS[mode, decisive] if decisive else mode)
        commands = [each for each in pair if each.is_command]
        assert {each for each, _ in found.refusals} == set(commands) - {decisive}
        assert all(reason for _, reason in found.refusals)


@modes
def test_safe_is_one_fault_or_command_away_whatever_else_happens(mode: Mode) -> None:
    for other in Trigger:
        assert step(mode, [Trigger.FAULT_SAFE, other]).mode is Mode.SAFE
        assert step(mode, [Trigger.TO_SAFE, other]).mode is Mode.SAFE


@modes
def test_every_mode_is_left_and_safe_by_command_alone(mode: Mode) -> None:
    leaving = {trigger for (source, trigger), target in TRANSITIONS.items() if source is mode is not target}
    assert leaving
    if mode is Mode.SAFE:
        assert all(trigger.is_command for trigger in leaving)


@modes
def test_from_every_mode_every_other_one_can_be_reached(mode: Mode) -> None:
    reached = {mode}
    while more := {target for (source, _), target in TRANSITIONS.items() if source in reached} - reached:
        reached |= more
    assert reached == set(Mode)


def test_a_held_set_of_triggers_settles_instead_of_going_round() -> None:
    """Conditions that hold from tick to tick, with no command, bring a mode that stays."""
    contradictions = (
        {Trigger.TARGET_LEFT, Trigger.TARGET_REACHED},
        {Trigger.RECONFIGURATION_BEGAN, Trigger.RECONFIGURATION_ENDED},
        {Trigger.STATE_LOST, Trigger.ACQUIRED},
    )
    once = {Trigger.ACQUIRED, Trigger.RECONFIGURATION_BEGAN, Trigger.RECONFIGURATION_ENDED}
    held = [each for each in Trigger if not each.is_command and each not in once]
    for size in range(4):
        for triggers in combinations(held, size):
            if any(pair <= set(triggers) for pair in contradictions):
                continue
            if {Trigger.STATE_LOST, Trigger.TARGET_REACHED} <= set(triggers):
                continue  # without a state there is no control error
            for mode in Mode:
                visited = [mode]
                for _ in range(len(Mode)):
                    visited.append(step(visited[-1], triggers).mode)
                assert visited[-1] is visited[-2], (triggers, visited)


def test_a_fault_that_holds_overrules_event_and_command() -> None:
    assert step(Mode.AVOID, [Trigger.FAULT_AVOID, Trigger.SEPARATION_RESTORED]).mode is Mode.AVOID
    assert step(Mode.ACQUIRE, [Trigger.FAULT_ACQUIRE, Trigger.TARGET_REACHED]).mode is Mode.ACQUIRE
    found = step(Mode.SAFE, [Trigger.FAULT_SAFE, Trigger.TO_ACQUIRE])
    assert found.mode is Mode.SAFE
    assert found.refusals == ((Trigger.TO_ACQUIRE, "overruled by fault safe, which leads to safe"),)


def test_standby_gives_no_thrust_whatever_event_there_is() -> None:
    events = [each for each in Trigger if not each.is_command and each not in FAULTS.values()]
    assert step(Mode.STANDBY, events).mode is Mode.STANDBY


def test_without_a_state_nothing_is_avoided_or_kept() -> None:
    assert step(Mode.KEEP, [Trigger.STATE_LOST]).mode is Mode.ACQUIRE
    assert step(Mode.AVOID, [Trigger.STATE_LOST]).mode is Mode.SAFE


@modes
def test_a_refusal_is_known_before_the_command_is_given(mode: Mode) -> None:
    for wanted, command in COMMANDS.items():
        assert refusal(mode, wanted) == dict(step(mode, [command]).refusals).get(command, "")


def test_the_diagram_has_every_arrow_and_the_table_every_trigger() -> None:
    lines = diagram().splitlines()
    arrows = {(source, target) for (source, _), target in TRANSITIONS.items() if source is not target}
    drawn = [line for line in lines if "-->" in line]
    assert len(drawn) == len(arrows)
    for (source, trigger), target in TRANSITIONS.items():
        if source is not target:
            (line,) = [each for each in drawn if each.startswith(f"  {source} --> {target}:")]
            assert trigger in line.partition(": ")[2].split(", ")
    assert all(f"| {trigger} |" in table() for trigger in Trigger)
