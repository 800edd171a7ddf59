"""Starts of a recorded run's modules, and the parameters of each."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.topics import QUEUE_DEPTH
from formation_gnc.messages.conversion import codec
from formation_gnc.mode_records import NO_FORCE, ModeState
from formation_gnc.parameters import to_json
from formation_gnc.recording import Bag
from formation_gnc.recording.in_process_recorder import reader
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Event, EventKind, ParameterChange, Timing
from formation_gnc.sil.starts import Start, starts_of
from formation_gnc.types import NANOSECONDS

NODE = "/deputy1/supervisor"


def changed(tick: int, old: Any, new: Any, kind: int = EventKind.PARAMETERS, name: str = "mode", **other: str) -> Event:
    change = ParameterChange(name, to_json(old), to_json(new))
    return Event(tick * NANOSECONDS, tick, other.get("node", NODE), kind, other.get("subject", ""), [change])


def recorded(directory: Path, starts: Sequence[tuple[int, int, dict[str, Any]]], events: Sequence[Event]) -> Bag:
    """A bag of 20 ticks; starts: first tick, first tick answered and parameters as recorded of each."""
    metadata = {
        parameters_record(NODE, answered * NANOSECONDS if place else None): {
            name: to_json(value) for name, value in values.items()
        }
        for place, (_, answered, values) in enumerate(starts)
    }
    types = {"/deputy1/mode": ModeState, "/deputy1/timing": Timing, "/events": Event}
    with BagWriter(directory, metadata) as writer:
        for topic, record in types.items():
            writer.add_topic(topic, f"formation_gnc_msgs/msg/{record.message}", QUEUE_DEPTH)
        ends = [first for first, _, _ in starts[1:]] + [20]
        for (first, answered, _), end in zip(starts, ends, strict=True):
            for tick in range(first, end):
                time = tick * NANOSECONDS
                timing = codec(Timing).encode(Timing(time, "supervisor", 1000))
                writer.write("/deputy1/timing", timing, time, tick - first + 1)
                if tick >= answered:
                    mode = ModeState(time, "keep", "keep", 0, "", NO_FORCE, [])
                    writer.write("/deputy1/mode", codec(ModeState).encode(mode), time, tick - answered + 1)
        for number, event in enumerate(events, start=1):
            writer.write("/events", codec(Event).encode(event), event.time, number)
    return Bag(directory)


def starts(bag: Bag) -> list[Start]:
    return starts_of(bag, [NODE], reader(bag))[NODE]


def modes(bag: Bag) -> list[Any]:
    return [each.values["mode"] for each in starts(bag)]


@pytest.mark.parametrize("kind", [EventKind.PARAMETERS, EventKind.ASSIGNMENT, EventKind.MODE])
def test_each_start_has_the_values_before_its_own_first_change(tmp_path: Path, kind: int) -> None:
    asked_late = [(0, 0, {"mode": "keep", "tube": 5.0}), (10, 12, {"mode": "safe", "tube": 8.0})]
    events = [
        changed(3, "acquire", "keep", kind),
        changed(5, "keep", "safe", kind),
        changed(11, "standby", "safe", kind),
    ]
    first, again = starts(recorded(tmp_path / "bag", asked_late, events))
    assert first == Start(0, None, {"mode": "acquire", "tube": 5.0})
    assert again == Start(10 * NANOSECONDS, 12 * NANOSECONDS, {"mode": "standby", "tube": 8.0})


def test_of_two_changes_in_one_tick_the_first_counts(tmp_path: Path) -> None:
    for place, names in enumerate((("safe", "keep", "acquire"), ("acquire", "keep", "safe"))):
        events = [changed(5, old, new) for old, new in pairwise(names)]
        assert modes(recorded(tmp_path / f"{place}", [(0, 0, {"mode": names[-1]})], events)) == [names[0]]


@pytest.mark.parametrize(
    "event",
    [
        changed(5, "safe", "keep", EventKind.WARNING),
        changed(5, "safe", "keep", node="/deputy2/supervisor"),
        changed(5, "safe", "keep", subject="/deputy1/mode"),
        changed(5, "safe", "keep", name="colour"),
    ],
    ids=["of another kind", "of another node", "of a topic", "of no parameter"],
)
def test_what_is_no_change_of_the_node_counts_for_nothing(tmp_path: Path, event: Event) -> None:
    (only,) = starts(recorded(tmp_path / "bag", [(0, 0, {"mode": "keep"})], [event]))
    assert only.values == {"mode": "keep"}


def test_a_change_from_what_is_no_json_is_refused(tmp_path: Path) -> None:
    event = changed(5, "acquire", "keep")
    event.changes[0].old_value = "{"
    bag = recorded(tmp_path / "bag", [(0, 0, {"mode": "keep"})], [event])
    with pytest.raises(ConfigurationError, match=f"a recorded change of {NODE} is no JSON"):
        starts(bag)


def test_a_start_without_recorded_parameters_has_none(tmp_path: Path) -> None:
    first, again = starts(recorded(tmp_path / "bag", [(0, 0, {"mode": "keep"}), (10, 10, {})], []))
    assert first.values
    assert not again.values
