"""Records become the bytes that ROS makes of their messages, and come back, bit for bit."""

import contextlib
import dataclasses
import re
import struct
from collections.abc import Iterable
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from formation_gnc_msgs import msg as messages
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rclpy.serialization import deserialize_message, serialize_message

from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.conversion import from_cdr, to_cdr
from formation_gnc.recording.decode import installed_type
from formation_gnc.transport.message_types import message_type
from formation_gnc.transport.raw_topics import first_stamp
from formation_gnc.types import NANOSECONDS

RECORDS = [each for each in vars(records).values() if dataclasses.is_dataclass(each)]
RECORDS.remove(records.NavigationState)  # an excerpt of an estimate
MESSAGES = [each for each in RECORDS if "time" in each.__dataclass_fields__]  # the others are part of these
SCALARS: dict[str, st.SearchStrategy[Any]] = {
    "double": st.floats(),  # with NaNs, infinities, signed zeros and subnormals
    "boolean": st.booleans(),
    "string": st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20),
    **{f"uint{size}": st.integers(0, 2**size - 1) for size in (8, 32, 64)},
}
STAMPS = st.integers(0, 2**31 * NANOSECONDS - 1)
TIMES = st.integers(-(2**31) * NANOSECONDS, 2**31 * NANOSECONDS - 1)
SCALARS |= {f"builtin_interfaces/{name}": TIMES for name in ("Time", "Duration")}
ROWS = {"RelativeState": ("double", (-1, 6)), "Interval": ("builtin_interfaces/Time", (-1, 2))}


def values(field: dataclasses.Field[Any], hint: Any, kind: str) -> st.SearchStrategy[Any]:
    """Whatever a field of a record may hold, by the type `kind` of the message's field."""
    element, count = re.fullmatch(r"(?:sequence<)?([\w/]+)(?:>|\[(\d+)\])?", kind).groups()  # type: ignore[union-attr]
    if element not in SCALARS and get_origin(hint) is list:
        return st.lists(instances(get_args(hint)[0]), max_size=3)
    if get_origin(hint) is np.ndarray:
        fixed = element, field.metadata.get("shape", count and (int(count),))
        element, shape = ROWS.get(element.rpartition("/")[2], fixed)
        (dtype,) = get_args(get_args(hint)[1])
        sizes = st.integers(0, 5).map(lambda rows: tuple(rows if side == -1 else side for side in shape))
        return sizes.flatmap(lambda size: hnp.arrays(dtype, size, elements=SCALARS[element]))
    if get_origin(hint) is list:
        length = {"min_size": int(count), "max_size": int(count)} if count else {"max_size": 6}
        return st.lists(SCALARS[element], **length)
    return SCALARS[element]


def instances(record: type) -> st.SearchStrategy[Any]:
    kinds = message_type(record).get_fields_and_field_types()
    hints = get_type_hints(record)
    fields = {
        field.name: STAMPS if field.name == "time" else values(field, hints[field.name], kinds[field.name])
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


def numbers(value: Any) -> list[Any]:
    """All numbers in a message or sequence, times in ns."""
    if hasattr(value, "nanosec"):
        return [value.sec * NANOSECONDS + value.nanosec]
    if hasattr(value, "get_fields_and_field_types"):
        return numbers([getattr(value, name) for name in value.get_fields_and_field_types()])
    return [number for each in value for number in numbers(each)] if isinstance(value, Iterable) else [value]


def plain(record: Any, message: Any) -> Any:
    """A record's fields and types with the values of a message that ROS has read."""
    hints = get_type_hints(type(record))
    values = {}
    for field in dataclasses.fields(record):
        mine = getattr(record, field.name)
        if field.name == "time":
            stamp = message.header.stamp
            values["time"] = stamp.sec * NANOSECONDS + stamp.nanosec
            continue
        theirs = getattr(message, field.name)
        if get_origin(hints[field.name]) is np.ndarray:
            theirs = np.array(numbers(theirs), dtype=mine.dtype).reshape(mine.shape)
        elif hasattr(theirs, "nanosec"):
            (theirs,) = numbers(theirs)
        elif get_origin(hints[field.name]) is list:
            nested = mine and dataclasses.is_dataclass(mine[0])
            theirs = [plain(*pair) for pair in zip(mine, theirs, strict=True)] if nested else list(theirs)
        values[field.name] = theirs
    return type(record)(**values)


@given(st.sampled_from(MESSAGES).flatmap(instances))
def test_ros_reads_what_is_written_bit_for_bit(record: Any) -> None:
    received = deserialize_message(to_cdr(record), message_type(type(record)))
    assert bits(plain(record, received)) == bits(record)


@given(st.sampled_from(MESSAGES).flatmap(instances))
def test_what_ros_writes_is_read_bit_for_bit(record: Any) -> None:
    message = deserialize_message(to_cdr(record), message_type(type(record)))
    assert bits(from_cdr(type(record), serialize_message(message))) == bits(record)


@given(st.sampled_from(MESSAGES).flatmap(instances))
def test_gaps_are_zero_and_no_byte_is_too_many(record: Any) -> None:
    kind = installed_type(f"formation_gnc_msgs/msg/{type(record).__name__}")
    assert kind.canonical(to_cdr(record)) == to_cdr(record)


@given(st.lists(instances(records.Estimate), min_size=2, max_size=4))
def test_a_reader_is_not_led_astray_by_what_it_read_before(estimates: list[records.Estimate]) -> None:
    """Messages of one length differ in what they hold: readings in one take the room of words in the next."""
    for estimate in estimates:
        assert bits(from_cdr(records.Estimate, to_cdr(estimate))) == bits(estimate)


def test_swapped_lists_in_messages_of_one_length_are_told_apart() -> None:
    """Every count of the message itself is the same: only those in its elements differ."""
    one, other = (
        records.Estimate(
            *(0, np.zeros(6), np.zeros(6), 1.0, np.eye(6), False),
            innovations=[records.Innovation(name, [1.0], [1.0], 0.5) for name in names],
            nis=1.0,
            status=0,
        )
        for names in (("abc", "abcdefg"), ("abcdefg", "abc"))
    )
    assert len(to_cdr(one)) == len(to_cdr(other))
    for estimate in (one, other, one):
        assert bits(from_cdr(records.Estimate, to_cdr(estimate))) == bits(estimate)


def test_bytes_that_are_no_such_message_are_rejected() -> None:
    data = to_cdr(records.Thrust(5, np.ones(3)))
    for cut in range(4, len(data)):
        with pytest.raises(ConfigurationError, match=r"bytes do not fit message type Thrust"):
            from_cdr(records.Thrust, data[:cut])
    with pytest.raises(ConfigurationError, match="do not fit message type Estimate"):
        from_cdr(records.Estimate, data)
    truth = bytearray(to_cdr(records.Truth(5, np.zeros(6), [])))
    truth[-4:] = b"\xff\xff\xff\xff"  # this many deputies
    with pytest.raises(ConfigurationError, match="4294967295 elements in"):
        from_cdr(records.Truth, bytes(truth))


@given(st.sampled_from(MESSAGES), st.data())
def test_whatever_is_heard_is_read_or_rejected(record: type, data: st.DataObject) -> None:
    """Never is there another exception, whatever becomes of a message on its way."""
    heard = bytearray(to_cdr(data.draw(instances(record))))
    places = st.integers(0, len(heard) - 1)
    for place, byte in data.draw(st.dictionaries(places, st.integers(0, 255), max_size=3)).items():
        heard[place] = byte
    cut = data.draw(st.none() | places)
    for kind in [record, records.NavigationState] if record is records.Estimate else [record]:
        with contextlib.suppress(ConfigurationError):
            from_cdr(kind, bytes(heard[:cut]))


def test_bytes_behind_a_message_are_passed_over() -> None:
    status = records.Status(5, "lqr", np.ones(3), [True, False, True], iterations=2)
    assert bits(from_cdr(records.Status, to_cdr(status) + b"more")) == bits(status)


def test_text_that_is_not_utf8_is_marked_as_such() -> None:
    data = to_cdr(records.Timing(5, "plant", 100))
    assert from_cdr(records.Timing, data.replace(b"plant", b"pl\xffnt")).node == "pl\N{REPLACEMENT CHARACTER}nt"


def test_text_without_its_zero_is_empty() -> None:
    """As some who write DDS have it."""
    data = struct.pack("<2s2x7i", b"\0\1", 5, 6, 0, 0, 0, 100, 0)
    assert bits(from_cdr(records.Timing, data)) == bits(records.Timing(5_000_000_006, "", 100))


@pytest.mark.parametrize(
    "force",
    [[1, 2, 3], np.array([1, 2, 3]), np.array([1, 2, 3], ">f8"), np.arange(6.0)[1:4], np.r_[3:0:-1.0][::-1]],
)
def test_numbers_of_any_type_and_layout_are_written(force: Any) -> None:
    assert to_cdr(records.Thrust(5, force)) == to_cdr(records.Thrust(5, np.array([1.0, 2.0, 3.0])))


def test_a_matrix_is_written_row_by_row() -> None:
    rows = np.arange(12.0).reshape(2, 6)
    target = records.Target(5, "", np.zeros(6), 1, np.asfortranarray(rows))
    assert from_cdr(records.Target, to_cdr(target)).preview.tolist() == rows.tolist()


def test_what_is_read_is_the_readers_own() -> None:
    data = to_cdr(records.Thrust(5, np.ones(3)))
    mine, other = from_cdr(records.Thrust, data), from_cdr(records.Thrust, data)
    mine.force[:] = 2.0
    assert other.force.tolist() == from_cdr(records.Thrust, data).force.tolist() == [1.0, 1.0, 1.0]


def test_a_field_of_the_wrong_length_is_not_written() -> None:
    with pytest.raises(ValueError, match="2 numbers where the message has 3"):
        to_cdr(records.Thrust(0, np.ones(2)))
    with pytest.raises(ValueError, match="4 numbers where the message has 3"):
        to_cdr(records.Status(0, "lqr", np.ones(3), [True] * 4))
    with pytest.raises(ValueError, match="13 numbers in rows of 6"):
        to_cdr(records.Target(0, "", np.zeros(6), 1, np.ones(13)))


@pytest.mark.parametrize(
    ("duration", "sec", "nanosec"), [(0, 0, 0), (-1, -1, 999_999_999), (-1_500_000_000, -2, 500_000_000)]
)
def test_a_negative_duration_has_its_seconds_rounded_down(duration: int, sec: int, nanosec: int) -> None:
    message = deserialize_message(to_cdr(records.Timing(0, "plant", duration)), messages.Timing)
    assert (message.compute_time.sec, message.compute_time.nanosec) == (sec, nanosec)
    assert from_cdr(records.Timing, serialize_message(message)).compute_time == duration


@pytest.mark.parametrize("time", [2**31 * NANOSECONDS, -(2**31) * NANOSECONDS - 1])
def test_a_time_beyond_32_bits_of_seconds_is_not_written(time: int) -> None:
    with pytest.raises(ValueError, match="Timing: 'i' format requires"):
        to_cdr(records.Timing(0, "plant", time))
    with pytest.raises(ValueError, match=r"eclipses: .* s, must be within 32 bits"):
        to_cdr(records.Target(0, "", np.zeros(6), 1, np.ones((0, 6)), np.array([[0, time]])))


def test_times_that_are_not_whole_nanoseconds_are_not_written() -> None:
    with pytest.raises(ValueError, match=r"eclipses: float64 of shape \(1, 2\), must be int64 \(N, 2\)"):
        to_cdr(records.Target(0, "", np.zeros(6), 1, np.ones((0, 6)), np.array([[0.0, 1.0]])))


@pytest.mark.parametrize("record", RECORDS)
def test_record_and_message_have_the_same_fields(record: type) -> None:
    of_record = {field.name for field in dataclasses.fields(record)}
    of_message = set(message_type(record).get_fields_and_field_types())
    assert of_record - {"time"} == of_message - {"header"}
    assert ("time" in of_record) == ("header" in of_message)


@given(TIMES)
def test_a_stamp_carries_every_nanosecond(time: int) -> None:
    data = to_cdr(records.Thrust(time, np.zeros(3)))
    stamp = deserialize_message(data, messages.Thrust).header.stamp
    assert (stamp.sec, stamp.nanosec) == divmod(time, 10**9)
    assert first_stamp(data) == from_cdr(records.Thrust, data).time == time


@given(st.sampled_from(MESSAGES).flatmap(instances))
def test_every_message_of_the_loop_names_its_frame(record: Any) -> None:
    frames = {"Measurement": "inertial", "Truth": "inertial", "Event": "", "Timing": ""}
    message = deserialize_message(to_cdr(record), message_type(type(record)))
    assert message.header.frame_id == frames.get(type(record).__name__, "hill")


def constants(kind: Any) -> dict[str, Any]:
    """Names and values of a message's constants."""
    return {name: getattr(kind, name) for name in dir(type(kind)) if name[0].isupper() and name.isupper()}


def test_constants_of_records_equal_those_of_messages() -> None:
    assert constants(messages.Estimate) == {each.name: each.value for each in records.EstimateStatus}
    assert constants(messages.RejectionCount) == {each.name: each.value for each in records.Rejection}
    assert constants(messages.Event) == {each.name: each.value for each in records.EventKind}


@given(instances(records.Estimate), st.sampled_from(["hill", "", "rtn ", "lvlh", "deputy1/hill"]))
def test_a_navigation_state_is_read_from_an_estimate_in_any_frame(estimate: records.Estimate, frame: str) -> None:
    message = deserialize_message(to_cdr(estimate), messages.Estimate)
    message.header.frame_id = frame
    heard = from_cdr(records.NavigationState, serialize_message(message))
    assert (heard.time, struct.pack("<d", heard.mass)) == (estimate.time, struct.pack("<d", estimate.mass))
    assert heard.relative_state.tobytes() == estimate.relative_state.tobytes()
    assert heard.chief_state.tobytes() == estimate.chief_state.tobytes()


def test_numbers_the_other_way_round_are_read_too() -> None:
    """As a machine of the other byte order writes them."""
    estimate = records.Thrust(7_000_000_003, np.array([1.0, -2.0, 3e-9]))
    turned = b"\0\0\0\0" + struct.pack(">iII5s3x4x3d", 7, 3, 5, b"hill\0", *estimate.force)
    assert bits(from_cdr(records.Thrust, turned)) == bits(estimate)
