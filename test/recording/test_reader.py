import builtins
import struct
import subprocess
import sys
import tracemalloc
from contextlib import suppress
from itertools import groupby

import numpy as np
import pytest
from builtin_interfaces.msg import Duration
from formation_gnc_msgs.msg import Event, Measurement, Reading, Target
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import ByteMultiArray, Empty, Float64MultiArray, MultiArrayDimension

from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.recording import Bag, identical, read
from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.recording.writer import BagWriter

finite = st.floats(allow_nan=False)
text = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)


def test_messages_come_in_recorded_order_and_as_written(bag_path, flight) -> None:
    assert list(Bag(bag_path).messages()) == [(m.topic, m.data, m.stamp_ns) for m in flight]


def test_a_single_file_is_the_same_bag(bag_path) -> None:
    assert list(Bag(bag_path / "flight_0.mcap").messages()) == list(Bag(bag_path).messages())


def test_messages_are_selected_by_topic_and_time(bag_path, flight) -> None:
    read_ = list(Bag(bag_path).messages(["/events", "/clock"], 28_500_000_000, 53_500_000_000))
    assert read_ == [
        (m.topic, m.data, m.stamp_ns)
        for m in flight
        if m.topic in ("/events", "/clock") and 28_500_000_000 <= m.stamp_ns < 53_500_000_000
    ]


def test_topics_are_listed_with_type_and_count(bag_path, flight) -> None:
    topics = Bag(bag_path).topics
    assert {t.name: t.type_name for t in topics.values()} == {m.topic: m.type_name for m in flight}
    assert sum(t.count for t in topics.values()) == len(flight)


def test_arrays_equal_the_messages_sent(bag_path, flight) -> None:
    bag = Bag(bag_path)
    estimates = [m for m in flight if m.topic == "/deputy1/estimate"]
    arrays = bag.arrays("/deputy1/estimate")
    assert arrays["stamp_ns"].tolist() == [m.stamp_ns for m in estimates]
    assert arrays["time"].tolist() == pytest.approx([m.stamp_ns / 1e9 for m in estimates], rel=1e-15)
    assert np.array_equal(arrays["relative_state"], [m.message.relative_state for m in estimates])
    assert np.array_equal(arrays["covariance"], [m.message.covariance for m in estimates])
    assert arrays["nis"].tolist() == [m.message.nis for m in estimates]
    assert arrays["status"].tolist() == [m.message.status for m in estimates]
    assert arrays["header.stamp.sec"].tolist() == [m.message.header.stamp.sec for m in estimates]
    assert set(arrays["header.frame_id"]) == {"hill"}
    for row, recorded in enumerate(estimates):
        for index, innovation in enumerate(recorded.message.innovations):
            assert arrays[f"innovations.{index}.sensor"][row] == innovation.sensor
            assert list(arrays[f"innovations.{index}.values"][row]) == list(innovation.values)


def test_arrays_number_nested_messages_and_keep_text(bag_path, flight) -> None:
    bag = Bag(bag_path)
    truths = [m.message for m in flight if m.topic == "/truth"]
    arrays = bag.arrays("/truth")
    assert set(arrays["deputies.1.name"]) == {"the second deputy"}
    assert np.array_equal(arrays["deputies.0.inertial_state"], [t.deputies[0].inertial_state for t in truths])
    assert arrays["deputies.1.eclipse"].tolist() == [t.deputies[1].eclipse for t in truths]
    events = [m.message for m in flight if m.topic == "/events"]
    assert bag.arrays("/events")["detail"].tolist() == [event.detail for event in events]


def test_a_field_of_another_type_or_none_is_named(bag_path) -> None:
    events = Bag(bag_path).arrays("/events")
    assert events.integers("tick").tolist() == events["tick"].tolist()
    with pytest.raises(BagError, match="topic /events: field detail is not of integers"):
        events.integers("detail")
    with pytest.raises(BagError, match="topic /events: no message has a field cause"):
        events["cause"]


def test_decoded_messages_have_the_fields_as_attributes(bag_path, flight) -> None:
    sent = [m.message for m in flight if m.topic == "/deputy1/thrust"]
    for (_, message, stamp), thrust in zip(Bag(bag_path).decoded(["/deputy1/thrust"]), sent, strict=True):
        assert message.force.tolist() == thrust.force.tolist()
        assert stamp == thrust.header.stamp.sec * 10**9 + thrust.header.stamp.nanosec


@settings(deadline=None)
@given(
    st.lists(
        st.builds(
            Measurement,
            readings=st.lists(st.builds(Reading, sensor=text, values=st.lists(finite, max_size=3)), max_size=3),
            mass=finite,
            eclipse=st.booleans(),
            fix=st.lists(finite, min_size=6, max_size=6),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_arrays_equal_the_deserialization_of_ros(messages) -> None:
    kind = installed_type("formation_gnc_msgs/msg/Measurement")
    data = [serialize_message(message) for message in messages]
    arrays = kind.arrays(data)
    for row, raw in enumerate(data):
        truth = deserialize_message(raw, Measurement)
        for field in ("mass", "eclipse", "fix"):
            assert np.array_equal(arrays[field][row], getattr(truth, field)), field
        for index, reading in enumerate(truth.readings):
            assert arrays[f"readings.{index}.sensor"][row] == reading.sensor
            assert np.array_equal(arrays[f"readings.{index}.values"][row], reading.values)


@settings(deadline=None)
@given(st.lists(st.builds(Event, node=text, subject=text, detail=text, tick=st.integers(0, 2**64 - 1)), min_size=1))
def test_text_of_any_length_is_read_back(messages) -> None:
    arrays = installed_type("formation_gnc_msgs/msg/Event").arrays([serialize_message(m) for m in messages])
    for field in ("node", "subject", "detail", "tick"):
        assert arrays[field].tolist() == [getattr(message, field) for message in messages]


def test_canonical_bytes_depend_on_the_fields_alone() -> None:
    # ROS leaves gaps and padding uninitialized.
    kind = installed_type("formation_gnc_msgs/msg/Target")
    data = bytearray(kind.canonical(serialize_message(Target(formation="ring", preview_step=Duration(sec=2)))))
    gap = data.index(b"ring\0") + 5
    assert data[gap : gap + 3] == bytes(3)
    dirty = bytes(data[:gap]) + b"\xaa\xbb\xcc" + bytes(data[gap + 3 :]) + b"left over"
    assert kind.canonical(dirty) == bytes(data)
    assert kind.message(dirty).preview_step.sec == 2
    assert deserialize_message(bytes(data), Target).formation == "ring"


def test_nested_sequences_of_different_lengths_leave_gaps() -> None:
    kind = installed_type("std_msgs/msg/Float64MultiArray")
    short, long = Float64MultiArray(data=[1.0]), Float64MultiArray(data=[2.0, 3.0])
    long.layout.dim = [MultiArrayDimension(label="row", size=2)]
    arrays = kind.arrays([serialize_message(message) for message in (short, long, short)])
    assert arrays["layout.dim.0.label"].tolist() == [None, "row", None]
    assert [row.tolist() for row in arrays["data"]] == [[1.0], [2.0, 3.0], [1.0]]


def test_an_empty_message_and_bytes_are_read() -> None:
    assert len(installed_type("std_msgs/msg/Empty").arrays([serialize_message(Empty())] * 3)) == 1
    message = ByteMultiArray(data=[b"\x01", b"\xff"])
    arrays = installed_type("std_msgs/msg/ByteMultiArray").arrays([serialize_message(message)])
    assert arrays["data"].tolist() == [[1, 255]]


def test_big_endian_messages_are_read() -> None:
    kind = installed_type("formation_gnc_msgs/msg/Thrust")
    body = struct.pack(">iII5s3x3d", 1, 2, 5, b"hill", 0.1, 0.2, 0.3)
    # The three doubles align to 8 after 20 bytes of header.
    body = body[:20] + bytes(4) + body[20:]
    arrays = kind.arrays([bytes(4) + body])
    assert arrays["force"].tolist() == [[0.1, 0.2, 0.3]]
    assert arrays["force"].dtype == np.float64
    assert arrays["header.stamp.nanosec"].tolist() == [2]


@pytest.mark.parametrize("data", [b"", b"\x00\x01", b"\x00\x01\x00\x00\x00", b"\x00\x07\x00\x00" + bytes(90)])
def test_bytes_that_do_not_fit_are_rejected(data) -> None:
    kind = installed_type("formation_gnc_msgs/msg/Thrust")
    with pytest.raises(ConfigurationError, match="Thrust"):
        kind.arrays([data])
    with pytest.raises(ConfigurationError, match="Thrust"):
        kind.message(data)


@settings(deadline=None)
@given(st.binary(max_size=120))
def test_any_bytes_are_read_or_rejected(data) -> None:
    kind = installed_type("formation_gnc_msgs/msg/Truth")
    for use in (kind.arrays, lambda messages: kind.message(messages[0])):
        with suppress(ConfigurationError):
            use([b"\x00\x01\x00\x00" + data])


@pytest.mark.parametrize(
    ("schema", "encoding"),
    [
        (b"float64 x", "ros2idl"),
        (b"not a definition !", "ros2msg"),
        (b"other_msgs/Missing x", "ros2msg"),
        (b"\xff", "ros2msg"),
        (b"wstring x", "ros2msg"),
    ],
)
def test_unknown_schemas_are_rejected_by_name(schema, encoding) -> None:
    with pytest.raises(ConfigurationError, match="a_msgs/msg/B"):
        MessageType("a_msgs/msg/B", schema, encoding).arrays([bytes([0, 1, 0, 0]) + bytes(8)])


def test_bags_that_differ_in_message_order_alone_are_identical(tmp_path, write_bag, flight) -> None:
    first = write_bag(tmp_path / "first", flight)
    otherwise = [m for _, tick in groupby(flight, key=lambda m: m.stamp_ns) for m in reversed(list(tick))]
    second = write_bag(tmp_path / "second", otherwise)
    topics = list(Bag(first).topics)
    assert list(Bag(first).messages()) != list(Bag(second).messages())
    assert identical(Bag(first), Bag(second), topics) == []


def test_the_first_difference_is_named_by_topic_stamp_and_field(tmp_path, write_bag, flight) -> None:
    kind = installed_type("formation_gnc_msgs/msg/Thrust")
    changed = list(flight)
    at = [index for index, m in enumerate(flight) if m.topic == "/deputy1/thrust"]
    for index in at[50:53]:
        message = deserialize_message(flight[index].data, type(flight[index].message))
        message.force[1] = np.nextafter(message.force[1], np.inf)  # one bit is a difference
        changed[index] = flight[index]._replace(data=kind.canonical(serialize_message(message)))
    del changed[next(index for index, m in enumerate(changed) if m.topic == "/events")]
    first, second = Bag(write_bag(tmp_path / "a", flight)), Bag(write_bag(tmp_path / "b", changed))
    events, thrust = identical(first, second, ["/events", "/clock", "/deputy1/thrust"])
    assert (events.topic, events.stamp_ns, events.field, events.second) == (
        "/events",
        3_500_000_000,
        "",
        None,
    )
    assert "only in the first bag" in str(events)
    assert (thrust.topic, thrust.stamp_ns, thrust.field) == (
        "/deputy1/thrust",
        flight[at[50]].stamp_ns,
        "force",
    )
    assert thrust.first[1] < thrust.second[1]
    assert "/deputy1/thrust at 50.5" in str(thrust)


def test_a_topic_in_one_bag_alone_is_a_difference(tmp_path, write_bag, flight) -> None:
    first = Bag(write_bag(tmp_path / "a", flight))
    second = Bag(write_bag(tmp_path / "b", [m for m in flight if m.topic != "/events"]))
    assert [(d.topic, d.stamp_ns) for d in identical(first, second, ["/events"])] == [("/events", 3_500_000_000)]
    assert [d.second for d in identical(second, first, ["/events"])] != [None]
    with pytest.raises(ConfigurationError, match="/nothing"):
        identical(first, second, ["/nothing"])


def test_bags_are_read_in_bounded_memory(tmp_path, flight) -> None:
    # mcap's own reader in file order holds the whole file; here it is one chunk at a time.
    bulk = bytes([0, 1, 0, 0]) + np.random.default_rng(0).bytes(50_000)
    with BagWriter(tmp_path / "run", {}) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=1)
        for stamp in range(1200):
            writer.write("/clock", bulk, stamp, stamp)
    bag = Bag(tmp_path / "run")
    tracemalloc.start()
    assert sum(1 for _ in bag.messages()) == 1200
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8e6  # of 60 MB; a chunk is 1 MB, held compressed, decompressed and as a copy


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4])
@pytest.mark.parametrize("chunked", [True, False])
def test_files_of_other_recorders_are_read(tmp_path, flight, compression, chunked) -> None:
    # rosbag2's "fastwrite" preset writes no chunks.
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, use_chunking=chunked)
        writer.start(profile="ros2")
        schema = writer.register_schema("rosgraph_msgs/msg/Clock", "ros2msg", b"builtin_interfaces/Time clock\n")
        channel = writer.register_channel("/clock", "cdr", schema)
        for stamp in (3, 1, 2):
            writer.add_message(channel, stamp, b"\0\1\0\0" + struct.pack("<iI", 0, stamp), stamp)
        writer.finish()
    bag = Bag(path)
    assert bag.damage is None
    assert [stamp for _, _, stamp in bag.messages()] == [3, 1, 2]
    assert (bag.start_ns, bag.end_ns) == (1, 3)
    assert [stamp for stamp, _, _ in bag.by_stamp(["/clock"])] == [1, 2, 3]


def test_a_missing_empty_or_foreign_path_is_rejected_in_one_line(tmp_path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("this is no bag, only words")
    (tmp_path / "nothing.mcap").touch()
    for name, words in [
        ("none", "no such bag"),
        ("empty", "no .mcap"),
        ("text.mcap", "not"),
        ("nothing.mcap", "not"),
    ]:
        with pytest.raises(ConfigurationError, match=f"{name}.*{words}") as caught:
            Bag(tmp_path / name)
        assert "\n" not in str(caught.value)


def test_an_unknown_topic_is_named_with_the_known_ones(bag_path) -> None:
    with pytest.raises(ConfigurationError, match=r"/nothing.*; it has /clock, /deputy1/estimate"):
        list(Bag(bag_path).messages(["/nothing"]))


def test_a_damaged_chunk_is_an_error_that_suggests_recovery(tmp_path, write_bag, flight) -> None:
    path = write_bag(tmp_path / "run", flight) / "run_0.mcap"
    data = bytearray(path.read_bytes())
    with path.open("rb") as stream:
        chunk = make_reader(stream).get_summary().chunk_indexes[0]
    data[chunk.chunk_start_offset + chunk.chunk_length - 10] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(ConfigurationError, match=r"run_0.mcap: damaged in the chunk at byte \d+ .*recover"):
        list(Bag(path).messages())


def test_read_returns_a_frame_per_topic(bag_path) -> None:
    pd = pytest.importorskip("pandas")
    frames = read(bag_path)
    assert isinstance(frames["/truth"], pd.DataFrame)
    assert (
        frames["/deputy1/thrust"]["force.2"].tolist() == Bag(bag_path).arrays("/deputy1/thrust")["force"][:, 2].tolist()
    )
    assert frames["/clock"].index.name == "time"


def test_read_without_pandas_names_the_package(bag_path, monkeypatch) -> None:
    real = builtins.__import__

    def without_pandas(name, *args):
        if name == "pandas":
            raise ImportError
        return real(name, *args)

    monkeypatch.setattr(builtins, "__import__", without_pandas)
    with pytest.raises(ConfigurationError, match="pip install pandas"):
        read(bag_path)


def test_reading_needs_no_ros() -> None:
    script = "import sys, formation_gnc.recording; print({'rclpy', 'ament_index_python'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
