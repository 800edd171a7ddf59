"""The fault table: what it accepts, and when it answers."""

from graphlib import TopologicalSorter

import pytest

from formation_gnc.common import Orbit
from formation_gnc.errors import ParameterError
from formation_gnc.supervision.fault_table import DEFAULT, Response, parse
from formation_gnc.supervision.modes import FAULTS, TRANSITIONS, Mode
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.registry import MONITORS
from formation_gnc.supervision.responses import FaultResponses
from formation_gnc.types import AXES

SENSORS = ("radius", "range_rate", "latitude")
SUBJECTS = {name: SENSORS if "innovation_b" in name or "frozen" in name else ("",) for name in MONITORS} | {
    "thrust_response": AXES
}


def table(*lines: str) -> FaultResponses:
    return FaultResponses(parse(lines, SUBJECTS, SENSORS, AXES, ("lqr", "mpc", "coast")))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{monitor: innovation_bais, response: warn}", "did you mean innovation_bias?"),
        ("{monitor: innovation_bias, subject: radios, response: warn}", "did you mean radius?"),
        ("{monitor: innovation_bias, response: wran}", "did you mean warn?"),
        ("{monitor: mass, response: go_to, mode: save}", "did you mean safe?"),
        ("{monitor: mass, response: go_to}", "mode None is unknown"),
        ("{monitor: mass, response: go_to, mode: keep}", "a fault does not lead to keep"),
        ("{monitor: mass, response: go_to, mode: acquire, modes: [avoid]}", "avoid stays in force"),
        ("{monitor: mass, response: warn, modes: [kep]}", "did you mean keep?"),
        ("{monitor: mass, response: warn, modes: []}", "modes must be a list"),
        ("{monitor: mass, response: warn, mode: safe}", "mode is for go_to"),
        ("{monitor: mass, response: warn, laws: [lqr]}", "laws are for switch_law"),
        ("{monitor: mass, response: switch_law}", "needs laws"),
        ("{monitor: mass, response: switch_law, laws: [lqr, lqr]}", "needs laws"),
        ("{monitor: mass, response: switch_law, laws: [lqg]}", "did you mean lqr?"),
        ("{monitor: mass, response: isolate_sensor}", "needs a monitor of each sensor"),
        ("{monitor: innovation_bias, response: isolate_axis}", "needs a monitor of each axis"),
        ("{monitor: mass, response: warn, persistence: 0}", "persistence is 0"),
        ("{monitor: mass, response: warn, persistence: 1.5}", "persistence is 1.5"),
        ("{monitor: mass, response: warn, return: -1}", "return is -1"),
        ("{monitor: mass, response: warn, retrun: 1}", "did you mean return?"),
        ("{monitor: mass}", "it must be like"),
        ("{monitor: [", "it must be like"),
        ("warn", "it must be like"),
    ],
)
def test_a_line_that_cannot_be_meant_is_rejected_with_the_reason(line: str, words: str) -> None:
    with pytest.raises(ParameterError) as rejection:
        table(line)
    assert str(rejection.value).startswith(f"parameter fault_table: {line!r} is not allowed; ")
    assert words in str(rejection.value)


def test_the_default_table_answers_every_monitor() -> None:
    subjects = {name: monitor.subjects(SupervisorParameters(chief=Orbit(7e6))) for name, monitor in MONITORS.items()}
    assert {entry.monitor for entry in parse(DEFAULT, subjects, SENSORS, AXES)} == set(MONITORS)


def test_no_table_leads_from_mode_to_mode_and_back() -> None:
    """The arrows of faults have no ring: whatever lines there are, modes settle."""
    graph: dict[Mode, set[Mode]] = {mode: set() for mode in Mode}
    for (mode, trigger), target in TRANSITIONS.items():
        if trigger in FAULTS.values() and target is not mode:
            graph[target].add(mode)
    TopologicalSorter(graph).prepare()


def test_a_response_waits_for_persistence_and_ends_after_its_return() -> None:
    responses = table("{monitor: mass, persistence: 3, response: warn, return: 5}")
    fault = [("mass", "")]
    active = [bool(responses.evaluate(fault, 1, Mode.KEEP)) for _ in range(4)]
    active += [bool(responses.evaluate([], 1, Mode.KEEP)) for _ in range(6)]
    assert active == [False, False, True, True, True, True, True, True, False, False]


def test_a_fault_that_comes_and_goes_does_not_persist() -> None:
    responses = table("{monitor: mass, persistence: 3, response: warn}")
    for _ in range(10):
        assert not responses.evaluate([("mass", "")], 1, Mode.KEEP)
        assert not responses.evaluate([("mass", "")], 1, Mode.KEEP)
        assert not responses.evaluate([], 1, Mode.KEEP)


def test_missed_ticks_count_for_persistence() -> None:
    responses = table("{monitor: mass, persistence: 3, response: warn}")
    assert responses.evaluate([("mass", "")], 3, Mode.KEEP)


def test_without_a_return_a_response_stays_until_it_is_released() -> None:
    responses = table("{monitor: mass, response: warn}")
    responses.evaluate([("mass", "")], 1, Mode.KEEP)
    assert responses.evaluate([], 10_000, Mode.KEEP)
    responses.release()
    assert not responses.evaluate([], 1, Mode.KEEP)


def test_a_response_whose_fault_goes_on_is_not_released() -> None:
    responses = table("{monitor: mass, response: warn}")
    responses.evaluate([("mass", "")], 1, Mode.KEEP)
    responses.release()
    assert responses.evaluate([], 1, Mode.KEEP)


def test_every_subject_of_a_pattern_has_its_own_response() -> None:
    responses = table("{monitor: innovation_bias, subject: 'ra*', response: isolate_sensor}")
    found = responses.evaluate([("innovation_bias", name) for name in SENSORS], 1, Mode.KEEP)
    assert [each.subject for each in found] == ["radius", "range_rate"]


def test_in_a_mode_in_which_a_line_does_not_hold_it_warns_and_says_so() -> None:
    responses = table("{monitor: mass, response: go_to, mode: safe, modes: [keep]}")
    (kept,) = responses.evaluate([("mass", "")], 1, Mode.KEEP)
    assert kept.response is Response.GO_TO
    (warned,) = responses.evaluate([("mass", "")], 1, Mode.STANDBY)
    assert warned.response is Response.WARN
    assert str(warned) == "mass: warn (go_to does not hold in this mode)"
