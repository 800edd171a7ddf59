"""Bags that others wrote, merged, cut or reordered: read by their data and by header stamp, run by run."""

import random
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from itertools import batched
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.typesys import Stores, get_typestore

from formation_gnc.errors import BagError
from formation_gnc.messages.definitions import schema_text
from formation_gnc.recording import Bag, identical
from formation_gnc.recording.recover import PARTLY_LOST, WHOLE, recover

RECEIVED = 1_764_000_000 * 10**9
"""Wall time (ns) at which a recorder of others begins to receive."""

INT32 = "int32 data\n"
ANOTHER_FLIGHT = 77
"""Mass (kg) by which another flight differs."""

Written = tuple[str, str, bytes, int]
"""Topic, type, data and log time."""


def written(messages: Iterable, log_time: Callable[[int], int] = lambda stamp: stamp) -> list[Written]:
    return [(m.topic, m.type_name, m.data, log_time(m.stamp_ns)) for m in messages]


def write_mcap(path: Path, messages: Iterable[Written], **options) -> Path:
    """An MCAP file by the bare writer."""
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start(profile="ros2")
        channels: dict[tuple[str, str], int] = {}
        for topic, kind, data, log_time in messages:
            if (topic, kind) not in channels:
                text = INT32 if kind == "std_msgs/msg/Int32" else schema_text(kind)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic, kind] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic, kind], log_time, data, log_time)
        writer.finish()
    return path


def same(one: Bag, other: Bag) -> bool:
    return not identical(one, other, sorted(set(one.topics) & set(other.topics)))


@pytest.mark.parametrize(
    "options",
    [
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"repeat_channels": False, "repeat_schemas": False, "use_statistics": False},
        {"index_types": IndexType.NONE},
        {"use_summary_offsets": False, "use_chunking": False},
        {"compression": CompressionType.NONE, "enable_crcs": False},
    ],
    ids=str,
)
def test_data_is_read_where_the_summary_is_silent(tmp_path, bag_path, flight, options) -> None:
    bag = Bag(write_mcap(tmp_path / "other.mcap", written(flight), **options))
    recovery = recover(bag.path, None)
    assert (recovery.status, recovery.saved, recovery.reasons) == (WHOLE, len(flight), ())
    assert {name: topic.count for name, topic in bag.topics.items()} == {
        name: topic.count for name, topic in Bag(bag_path).topics.items()
    }
    assert same(bag, Bag(bag_path))


def test_receive_times_do_not_matter(tmp_path, bag_path, flight) -> None:
    messages = written(flight, lambda stamp: RECEIVED + stamp // 10)
    messages.insert(0, ("/level", "std_msgs/msg/Int32", b"\0\1\0\0" + struct.pack("<i", 3), RECEIVED - 5))
    messages.append(("/level", "std_msgs/msg/Int32", b"\0\1\0\0" + struct.pack("<i", 4), RECEIVED + 10**12))
    bag = Bag(write_mcap(tmp_path / "received.mcap", messages, chunk_size=5000))
    assert same(bag, Bag(bag_path))
    assert (bag.start_ns, bag.end_ns) == (flight[0].stamp_ns, flight[-1].stamp_ns)
    assert bag.arrays("/level")["stamp_ns"].tolist() == [flight[0].stamp_ns, flight[-1].stamp_ns]
    stamps = [stamp for stamp, _, _ in bag.by_stamp(list(bag.topics))]
    assert stamps == sorted(stamps)


def test_sqlite3_bags_are_read_through_rosbags(tmp_path, bag_path, flight) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    with RosbagsWriter(tmp_path / "run", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for topic, kind, data, stamp in written(flight, lambda stamp: RECEIVED + stamp):
            if topic not in connections:
                text = schema_text(kind)
                connections[topic] = writer.add_connection(topic, kind, msgdef=text, rihs01="RIHS01_0", typestore=store)
            writer.write(connections[topic], stamp, data)
    for path in (tmp_path / "run", tmp_path / "run" / "run.db3"):
        bag = Bag(path)
        assert same(bag, Bag(bag_path))
        assert bag.topics.keys() == Bag(bag_path).topics.keys()
    assert MessageDefinition(MessageDefinitionFormat.NONE, "").data == ""


def test_a_broken_sqlite3_file_is_rejected_in_one_line(tmp_path) -> None:
    (tmp_path / "bad.db3").write_bytes(b"SQLite format 3\0" + bytes(200))
    with pytest.raises(BagError, match=r"bad\.db3: cannot be read as a sqlite3 bag") as caught:
        Bag(tmp_path / "bad.db3")
    assert "\n" not in str(caught.value)


def test_files_compressed_as_a_whole_are_read(tmp_path, bag_path) -> None:
    packed = zstandard.ZstdCompressor().compress((bag_path / "flight_0.mcap").read_bytes())
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run_0.mcap.zstd").write_bytes(packed)
    assert same(Bag(tmp_path / "run"), Bag(bag_path))


def merged_in_turn(flight: Sequence) -> list:
    return [each for message in flight for each in (message, message)]


@pytest.mark.parametrize("merge", [merged_in_turn, lambda flight: [*flight, *flight]], ids=["in turn", "on end"])
def test_what_two_recorders_wrote_counts_once(tmp_path, bag_path, flight, merge) -> None:
    bag = Bag(write_mcap(tmp_path / "merged.mcap", written(merge(flight))))
    assert same(bag, Bag(bag_path))
    assert len(bag.runs()) == 1
    assert [remark for remark in bag.remarks if remark.startswith(f"recorded twice: {len(flight)} messages")]


@pytest.mark.parametrize("how", ["chunks", "shuffled"])
def test_messages_out_of_order_are_sorted_by_stamp(tmp_path, bag_path, flight, how) -> None:
    messages = list(flight)
    if how == "chunks":
        parts = list(batched(messages, 100))
        messages = [message for part in (*parts[2:4], *parts[:2], *parts[4:]) for message in part]
    else:
        random.Random(3).shuffle(messages)
    bag = Bag(write_mcap(tmp_path / "mixed.mcap", written(messages), chunk_size=5000))
    assert same(bag, Bag(bag_path))
    for topic in bag.topics:
        assert np.all(np.diff(bag.arrays(topic)["time"]) >= 0.0)
        rows = [batch["time"] for _, batch in bag.batches([topic], 7)]
        assert np.array_equal(np.concatenate(rows), bag.arrays(topic)["time"])
    assert any("/truth: " in remark and "sorted by stamp" in remark for remark in bag.remarks)


def another(flight: Sequence) -> list:
    """The same flight but for one bit of every truth and estimate."""
    return [
        message._replace(data=message.data[:-1] + bytes([message.data[-1] ^ 1]))
        if message.topic in ("/truth", "/deputy1/estimate")
        else message
        for message in flight
    ]


def test_runs_on_end_are_told_apart(tmp_path, bag_path, flight) -> None:
    other = Bag(write_mcap(tmp_path / "other.mcap", written(another(flight))))
    bag = Bag(write_mcap(tmp_path / "both.mcap", [*written(flight), *written(another(flight))]))
    first, second = bag.runs()
    assert any("2 runs are in it" in remark for remark in bag.remarks)
    assert same(first, Bag(bag_path))
    assert same(second, other)
    assert {first.topics[name].count == second.topics[name].count for name in bag.topics} == {True}


def test_runs_with_the_same_truth_are_told_apart(tmp_path, bag_path, flight) -> None:
    """Flights that only coast differ by their seed in what is measured and estimated, not in where they are."""
    seed = [
        message._replace(data=message.data[:-1] + bytes([message.data[-1] ^ 1]))
        if message.topic in ("/deputy1/measurement", "/deputy1/estimate")
        else message
        for message in flight
    ]
    first, second = Bag(write_mcap(tmp_path / "both.mcap", [*written(flight), *written(seed)])).runs()
    assert same(first, Bag(bag_path))
    assert same(second, Bag(write_mcap(tmp_path / "seed.mcap", written(seed))))
    assert {first.topics[name].count == second.topics[name].count for name in first.topics} == {True}


def test_interleaved_runs_are_rejected(tmp_path, flight) -> None:
    pairs = zip(written(flight), written(another(flight)), strict=True)
    bag = Bag(write_mcap(tmp_path / "both.mcap", [each for pair in pairs for each in pair]))
    with pytest.raises(BagError, match=r"both\.mcap: several runs are mixed in it and cannot be told apart: /truth"):
        bag.runs()


def test_one_topic_with_two_types_is_read_as_the_runs(tmp_path, bag_path, flight) -> None:
    points = [("/truth", "geometry_msgs/msg/Point", b"\0\1\0\0" + bytes(24), stamp) for stamp in range(3)]
    bag = Bag(write_mcap(tmp_path / "two.mcap", [*points, *written(flight)]))
    assert same(bag, Bag(bag_path))
    assert "skipped: 3 messages of /truth of another type, geometry_msgs/msg/Point" in bag.remarks
    bag.check_own_types()
    alone = Bag(write_mcap(tmp_path / "points.mcap", points))
    with pytest.raises(BagError, match="topic /truth is of another type, geometry_msgs/msg/Point; it must be"):
        alone.check_own_types()


def test_missing_ticks_and_files_are_named_with_their_place(tmp_path, flight, write_bag) -> None:
    lacking = [m for m in flight if m.topic != "/truth" or not 30e9 < m.stamp_ns < 50e9]
    bag = Bag(write_mcap(tmp_path / "gap.mcap", written(lacking)))
    assert bag.tick_ns == 10**9
    assert bag.remarks == ["/truth: 20 of 120 ticks are missing, at 30.5 to 49.5 s"]
    run = write_bag(tmp_path / "run", flight)
    (run / "metadata.yaml").write_text(
        (run / "metadata.yaml").read_text().replace("- run_0.mcap", "- run_0.mcap\n  - b.mcap")
    )
    assert Bag(run).remarks == [f"{run / 'b.mcap'}: is missing"]


def test_a_stamp_beyond_64_bits_with_sign_is_read(tmp_path) -> None:
    late = 2**63 + 5
    bag = Bag(write_mcap(tmp_path / "late.mcap", [("/late", "std_msgs/msg/Int32", b"\0\1\0\0\7\0\0\0", late)]))
    assert bag.arrays("/late")["stamp_ns"].tolist() == [late]
    assert [stamp for _, _, stamp in bag.messages()] == [late]


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("field", [1, 49])
def test_chunks_of_any_compression_are_found_again(tmp_path, flight, compression, field) -> None:
    # a wrong length of the second chunk: of its record, or within it
    path = write_mcap(tmp_path / "run.mcap", written(flight), compression=compression, chunk_size=5000)
    content = bytearray(path.read_bytes())
    at = second_chunk(content)
    name = struct.unpack_from("<I", content, at + 37)[0]
    content[at + field + (name - 8 if field > 1 else 0) + 1] ^= 0x55
    path.write_bytes(content)
    result = recover(path, tmp_path / "saved")
    assert result.status in (WHOLE, PARTLY_LOST)
    assert result.saved >= 0.9 * len(flight)
    bag = Bag(result.output or path)  # mcap's reader does not mind a wrong length within
    assert bag.damage is None
    assert sum(topic.count for topic in bag.topics.values()) == result.saved


def test_whole_messages_of_a_cut_plain_chunk_are_saved(tmp_path, flight) -> None:
    path = write_mcap(tmp_path / "run.mcap", written(flight), compression=CompressionType.NONE, chunk_size=1 << 20)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    result = recover(path, tmp_path / "saved")
    assert result.status == PARTLY_LOST
    assert result.saved > 0.3 * len(flight)


def second_chunk(content: bytes) -> int:
    """Offset of the second chunk of a file."""
    offset, found = 8, 0
    while True:
        opcode, length = struct.unpack_from("<BQ", content, offset)
        found += opcode == 6
        if found == 2:
            return offset
        offset += 9 + length


def write_sqlite(path: Path, messages: Iterable[Written]) -> Path:
    """A file as rosbag2's own storage plug-in lays it out."""
    with closing(sqlite3.connect(path)) as database, database:
        database.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "INSERT INTO schema VALUES (4, 'jazzy');"
            "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format "
            "TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,"
            " encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
            "data BLOB NOT NULL);"
        )
        numbers: dict[str, int] = {}
        for topic, kind, data, time in messages:
            if topic not in numbers:
                numbers[topic] = len(numbers) + 1
                database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '', '')", (numbers[topic], topic, kind))
                row = (numbers[topic], kind, "ros2msg", schema_text(kind), "")
                database.execute("INSERT INTO message_definitions VALUES (?, ?, ?, ?, ?)", row)
            row = (numbers[topic], time, data)
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", row)
    return path


def test_a_whole_sqlite_bag_needs_no_recovery(tmp_path, bag_path, flight) -> None:
    path = write_sqlite(tmp_path / "other.db3", written(flight, lambda stamp: RECEIVED + stamp))
    recovery = recover(path, tmp_path / "saved")
    assert (recovery.status, recovery.saved, recovery.output) == (WHOLE, len(flight), None)
    assert same(Bag(path), Bag(bag_path))


@pytest.mark.parametrize("damage", ["cut", "overwritten"])
def test_of_a_damaged_sqlite_bag_the_pages_that_can_be_read_are_saved(tmp_path, bag_path, flight, damage) -> None:
    path = write_sqlite(tmp_path / "other.db3", written(flight, lambda stamp: RECEIVED + stamp))
    content = bytearray(path.read_bytes())
    if damage == "cut":
        del content[len(content) * 3 // 4 :]
    else:
        middle = len(content) // 2 // 4096 * 4096
        content[middle : middle + 4096] = b"\xff" * 4096
    path.write_bytes(content)
    recovery = recover(path, tmp_path / "saved")
    assert recovery.status == PARTLY_LOST
    assert "cannot be read" in recovery.reasons[-1]
    assert len(flight) // 2 < recovery.saved < len(flight)
    saved = {(topic, data) for topic, data, _ in Bag(tmp_path / "saved").messages()}
    assert saved < {(message.topic, message.data) for message in flight}


def test_a_run_whose_beginning_is_not_in_the_bag_says_so(tmp_path, flight) -> None:
    late = [message for message in flight if message.stamp_ns >= 20 * 10**9]
    assert (
        "begins at 20.5 s: the run before that is not in it"
        in Bag(write_mcap(tmp_path / "late.mcap", written(late))).remarks
    )


@pytest.mark.parametrize("topic", ["/clock", "/truth", "/deputy1/thrust"])
@pytest.mark.parametrize(
    "damage",
    [lambda data: b"", lambda data: data[:6], lambda data: data[:-9], lambda data: b"\0\7" + data[2:]],
    ids=["no bytes", "no header", "cut", "another encoding"],
)
def test_a_message_that_does_not_fit_its_type_is_skipped_and_told(tmp_path, bag_path, flight, topic, damage) -> None:
    place = next(i for i, message in enumerate(flight) if message.topic == topic and message.stamp_ns > 20 * 10**9)
    messages = written(flight)
    messages[place] = (*messages[place][:2], damage(messages[place][2]), messages[place][3])
    bag = Bag(write_mcap(tmp_path / "other.mcap", messages))
    (remark,) = (each for each in bag.remarks if each.startswith("skipped"))
    assert remark.startswith(f"skipped: 1 messages of {topic} that do not fit their type, first message ")
    assert "of the topic in other.mcap" in remark
    kept = [message.stamp_ns for message in flight if message.topic == topic and message is not flight[place]]
    assert bag.arrays(topic)["stamp_ns"].tolist() == kept


def test_plain_messages_are_read_where_metadata_calls_each_compressed(tmp_path, bag_path) -> None:
    bag = tmp_path / "bag"
    shutil.copytree(bag_path, bag)
    text = (bag / "metadata.yaml").read_text().replace("compression_mode: ''", "compression_mode: MESSAGE")
    (bag / "metadata.yaml").write_text(text)
    assert "MESSAGE" in text
    assert same(Bag(bag), Bag(bag_path))
