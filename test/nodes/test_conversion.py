"""Records and messages carry the same bits, there and back, through CDR as DDS sends it."""

import dataclasses
import re
import struct
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from formation_gnc_msgs import msg as messages
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rclpy.serialization import deserialize_message, serialize_message

from formation_gnc import interface
from formation_gnc.nodes.conversion import from_message, message_type, neighbour, stamp, to_message

RECORDS = [each for each in vars(interface).values() if dataclasses.is_dataclass(each)]
SCALARS: dict[str, st.SearchStrategy[Any]] = {
    "double": st.floats(),  # with NaNs, infinities, signed zeros and subnormals
    "boolean": st.booleans(),
    "string": st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20),
    **{f"uint{size}": st.integers(0, 2**size - 1) for size in (8, 32, 64)},
}
TIMES = st.integers(0, 2**31 * interface.NANOSECONDS - 1)


def values(field: dataclasses.Field[Any], hint: Any, kind: str) -> st.SearchStrategy[Any]:
    """Whatever a field of a record may hold, by the type `kind` of the message's field."""
    element, count = re.fullmatch(r"(?:sequence<)?([\w/]+)(?:>|\[(\d+)\])?", kind).groups()  # type: ignore[union-attr]
    if element not in SCALARS:
        return st.lists(records(getattr(interface, element.rpartition("/")[2])), max_size=3)
    if get_origin(hint) is np.ndarray:
        shape = field.metadata.get("shape", count and (int(count),))
        (dtype,) = get_args(get_args(hint)[1])
        sizes = st.integers(0, 5).map(lambda rows: tuple(rows if side == -1 else side for side in shape))
        return sizes.flatmap(lambda size: hnp.arrays(dtype, size, elements=SCALARS[element]))
    if get_origin(hint) is list:
        length = {"min_size": int(count), "max_size": int(count)} if count else {"max_size": 6}
        return st.lists(SCALARS[element], **length)
    return SCALARS[element]


def records(record: type) -> st.SearchStrategy[Any]:
    kinds = message_type(record).get_fields_and_field_types()
    hints = get_type_hints(record)
    fields = {
        field.name: TIMES if field.name == "time" else values(field, hints[field.name], kinds[field.name])
        for field in dataclasses.fields(record)
    }
    return st.builds(record, **fields)


def bits(value: Any) -> Any:
    """Everything that can be told of a value, floats by their bits."""
    if dataclasses.is_dataclass(value):
        return type(value), [bits(getattr(value, field.name)) for field in dataclasses.fields(value)]
    if isinstance(value, np.ndarray):
        return value.dtype, value.shape, value.tobytes()
    if isinstance(value, list):
        return [bits(each) for each in value]
    if isinstance(value, float):
        return float, struct.pack("<d", value)
    return type(value), value


@given(st.sampled_from(RECORDS).flatmap(records))
def test_a_record_comes_back_from_the_wire_bit_for_bit(record: Any) -> None:
    kind = message_type(type(record))
    received = deserialize_message(serialize_message(to_message(record)), kind)
    assert bits(from_message(type(record), received)) == bits(record)


@pytest.mark.parametrize("record", RECORDS)
def test_record_and_message_have_the_same_fields(record: type) -> None:
    of_record = {field.name for field in dataclasses.fields(record)}
    of_message = set(message_type(record).get_fields_and_field_types())
    assert of_record - {"time"} == of_message - {"header"}
    assert ("time" in of_record) == ("header" in of_message)


@given(TIMES)
def test_a_stamp_carries_every_nanosecond(time: int) -> None:
    message = to_message(interface.Thrust(time, np.zeros(3)))
    assert stamp(message) == time
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == divmod(time, 10**9)


@given(st.sampled_from([each for each in RECORDS if each is not interface.SatelliteTruth]).flatmap(records))
def test_every_message_of_the_loop_names_its_frame(record: Any) -> None:
    frames = {"Measurement": "inertial", "Truth": "inertial", "Event": "", "Timing": ""}
    assert to_message(record).header.frame_id == frames.get(type(record).__name__, "hill")


def constants(kind: Any) -> dict[str, int]:
    """Names and values of a message's constants."""
    return {name: getattr(kind, name) for name in dir(type(kind)) if name[0].isupper() and name.isupper()}


def test_numbers_that_stand_for_something_stand_for_the_same_in_records_and_messages() -> None:
    assert constants(messages.Measurement) == {each.name: each.value for each in interface.Sensor}
    status = {each.name: each.value for each in interface.EstimateStatus}
    refusals = {f"REFUSED_{each.name}": each.value for each in interface.Refusal}
    assert constants(messages.Estimate) == status | refusals


@given(records(interface.Estimate), st.sampled_from(["hill", "", "rtn ", "lvlh", "deputy1/hill"]))
def test_a_neighbour_is_read_from_the_bytes_of_an_estimate(estimate: interface.Estimate, frame: str) -> None:
    message = to_message(estimate)
    message.header.frame_id = frame
    heard = neighbour(serialize_message(message))
    assert (heard.time, struct.pack("<d", heard.mass)) == (estimate.time, struct.pack("<d", estimate.mass))
    assert heard.relative_state.tobytes() == estimate.relative_state.tobytes()
