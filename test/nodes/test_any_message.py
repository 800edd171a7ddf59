"""Every subscriber stands every message that its topic's type allows."""

import dataclasses
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH, Input, ModuleInstance, Row
from formation_gnc.messages.conversion import codec, from_cdr, received, to_cdr, type_name
from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.session import RecordingSession
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Event, Record
from formation_gnc.sil.plant_executive import PlantExecutive
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario
from formation_gnc.transport.message_types import message_type

WORDS = ["", "deputy1", "radius", "range_rate", "latitude", "lqr", "gate", "keep", "safe", "sensor"]
NAMES = st.sampled_from([*WORDS, "ä\U0001f6f0", "x" * 300])
DOUBLES = st.floats(width=64) | st.sampled_from([0.0, 1.0, 1e-300, 1e308, float("nan"), float("inf")])
STAMPS = st.integers(-(2**31) * 10**9, (2**31 - 1) * 10**9) | st.sampled_from([0, 10**9, 2 * 10**9])


def values(record_type: type[Record], name: str, hint: Any, field: dataclasses.Field[Any]) -> st.SearchStrategy[Any]:
    """Any value of a record's field that its message holds."""
    message = message_type(record_type).get_fields_and_field_types()
    kind = message.get(name, "")
    if name == "time" or kind.startswith("builtin_interfaces"):
        return STAMPS
    if hint is str:
        return NAMES
    if hint is bool:
        return st.booleans()
    if hint is float:
        return DOUBLES
    if hint is int:
        unsigned, bits = kind.startswith("u") or kind == "octet", int("".join(filter(str.isdigit, kind)) or 8)
        return st.integers(0, 2**bits - 1) if unsigned else st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    if get_origin(hint) is list:
        (element,) = get_args(hint)
        size = int(kind[kind.index("[") + 1 : -1]) if "[" in kind else None
        numbers = {float: DOUBLES, bool: st.booleans(), int: st.integers(0, 255)}
        of = any_record(element) if dataclasses.is_dataclass(element) else numbers[element]
        return st.lists(of, min_size=size or 0, max_size=size or 4)
    return array(name, field, kind)


def array(name: str, field: dataclasses.Field[Any], kind: str) -> st.SearchStrategy[Any]:
    shape = field.metadata.get("shape")
    if shape is None and kind.startswith("double["):
        shape = (int(kind[kind.index("[") + 1 : -1]),)
    if shape is not None:
        return arrays.arrays(np.float64, shape, elements=DOUBLES)
    if name == "eclipses":
        return arrays.arrays(np.int64, st.tuples(st.integers(0, 3), st.just(2)), elements=STAMPS)
    return arrays.arrays(np.float64, st.tuples(st.integers(0, 5), st.just(6)), elements=DOUBLES)


def any_record(record_type: type[Any]) -> st.SearchStrategy[Any]:
    hints = get_type_hints(record_type)
    fields = [field for field in dataclasses.fields(record_type) if field.init]
    assert not any(isinstance(hints[field.name], UnionType) for field in fields)
    return st.builds(
        record_type, **{field.name: values(record_type, field.name, hints[field.name], field) for field in fields}
    )


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("tetrahedral", {"/plant": {"duration": 100.0}})


@pytest.fixture(scope="module")
def flown(scenario: Scenario) -> dict[str, list[Any]]:
    """Records of two ticks by topic."""
    taken: dict[str, list[Any]] = {}
    run = Run(scenario)
    for _ in range(2):
        run.tick(lambda topic, record: taken.setdefault(topic, []).append(record))
    return taken


def messages(each: Input) -> st.SearchStrategy[bytes]:
    return any_record(each.topic.record).map(to_cdr)


CASES = [(row, each) for row in GRAPH for each in (*row.takes, *row.takes_of_before, *row.takes_of_others)]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("row", "hostile"), CASES, ids=lambda each: each.name if isinstance(each, Row) else each.topic.name
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=15)
@given(data=st.data())
def test_a_module_stands_any_message_and_answers_the_next_tick(
    scenario: Scenario, flown: dict[str, list[Any]], row: Row, hostile: Input, data: st.DataObject
) -> None:
    instance = ModuleInstance(row, "deputy1", scenario.deputies["deputy1"][row.name])

    def take(topic: str, record: Any) -> list[tuple[str, Any]]:
        inputs = instance.synchronizer.take(topic, record)
        return instance.respond(inputs) if inputs is not None else []

    everything = instance.inputs
    for topic, kind in everything.items():
        take(topic, from_cdr(kind, to_cdr(flown[topic][0])))
    name = hostile.topic.of("deputy2" if hostile in row.takes_of_others and hostile not in row.takes else "deputy1")
    for _ in range(2):
        try:
            bad = received(hostile.record)(data.draw(messages(hostile)))
        except ConfigurationError:  # does not reach a module
            continue
        bad.time = data.draw(st.sampled_from([bad.time, 10**9]))
        for topic, kind in everything.items():
            record = (
                bad if topic == name else dataclasses.replace(from_cdr(kind, to_cdr(flown[topic][1])), time=bad.time)
            )
            for _, output in take(topic, record):
                to_cdr(output)
        for event in instance.take_events():
            to_cdr(event)


class Nobody:
    """Surroundings of a plant that hears everything and says nothing."""

    def publishers_of(self, topic: str) -> list[str]:
        return ["/somebody"]

    def __getattr__(self, name: str) -> Any:
        return lambda *_: True


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(thrusts=st.lists(any_record(records.Thrust), max_size=5), stamps=st.lists(STAMPS, max_size=5))
def test_the_plant_stands_any_command_and_any_progress(
    scenario: Scenario, thrusts: list[records.Thrust], stamps: list[int]
) -> None:
    executive = PlantExecutive(scenario.plant, Nobody())  # type: ignore[arg-type]
    executive.check(0.0)
    for thrust in thrusts:
        executive.answer("deputy1", from_cdr(records.Thrust, to_cdr(thrust)), 0.0)
        thrust.time = executive.simulation.plant.time
        for deputy in scenario.plant.deputies:
            executive.answer(deputy, thrust, 0.0)
    for stamp in stamps:
        executive.recorded(stamp, 0.0)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=20)
@given(data=st.data())
@pytest.mark.thorough
def test_the_recorder_stands_any_message_of_any_topic(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    ours = [(each.name, each.record) for each in topics.RUN_TOPICS if each.record]
    ours += [(each.of("deputy1"), each.record) for each in topics.DEPUTY_TOPICS]
    ours.append((topics.CLOCK.name, records.Clock))
    reported: list[int] = []
    path: Path = tmp_path_factory.mktemp("any") / "bag"
    session = RecordingSession(BagWriter(path, provenance(), {}), "any", reported.append, codec(Event).decode)
    for topic, record_type in ours:
        wrong = data.draw(st.booleans())
        take = session.open_topic(
            topic, "std_msgs/msg/String" if wrong else type_name(record_type), lambda: {b"": "/somebody"}, True
        )
        for _ in range(2):
            message = b"\0\1\0\0\1\0\0\0\0" if wrong else to_cdr(data.draw(any_record(record_type)))
            about = {"stamp": data.draw(st.integers(0, 2**62)), "publisher": data.draw(st.binary(max_size=1))}
            take(message, about | {"publication_sequence_number": data.draw(st.integers(1, 3))})
    session.report_progress()
    session.put_on_record("/foreign", "parameters /foreign", {"raw": [b"\1", b"\2"], "none": [], "nan": float("nan")})
    session.close()
    assert session.failure is None
