import signal
import struct
import subprocess
import sys
import time

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.definitions import type_hash
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.recover import NOTHING_SAVED, PARTLY_LOST, recover
from formation_gnc.recording.writer import FLUSH_INTERVAL, BagWriter, Split


def test_rosbags_reads_every_byte_back(bag_path, flight) -> None:
    with Reader(bag_path) as reader:
        read = [(connection.topic, data, stamp) for connection, stamp, data in reader.messages()]
        assert reader.message_count == len(flight)
        assert reader.ros_distro == "jazzy"
        assert {topic: info.msgtype for topic, info in reader.topics.items()} == {
            message.topic: message.type_name for message in flight
        }
    assert sorted(read) == sorted((m.topic, m.data, m.stamp_ns) for m in flight)


def test_rosbags_decodes_every_message_by_the_schema_in_the_bag(bag_path, flight) -> None:
    sent = [m.message for m in flight if m.topic == "/truth"]
    with AnyReader([bag_path]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
        wanted = [connection for connection in reader.connections if connection.topic == "/truth"]
        for (connection, _, data), truth in zip(reader.messages(wanted), sent, strict=True):
            read = reader.deserialize(data, connection.msgtype)
            assert read.chief_state.tolist() == truth.chief_state.tolist()
            assert [deputy.name for deputy in read.deputies] == [deputy.name for deputy in truth.deputies]
            assert [deputy.mass for deputy in read.deputies] == [deputy.mass for deputy in truth.deputies]


def test_mcap_ros2_support_decodes_every_message(bag_path, flight) -> None:
    with (bag_path / "flight_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        decoded = list(reader.iter_decoded_messages())
    assert len(decoded) == len(flight)
    estimates = [message for _, channel, _, message in decoded if channel.topic == "/deputy1/estimate"]
    sent = [m.message for m in flight if m.topic == "/deputy1/estimate"]
    assert [list(read.covariance) for read in estimates] == [list(message.covariance) for message in sent]
    assert [read.header.frame_id for read in estimates] == ["hill"] * len(sent)


def test_channels_carry_the_quality_of_service_and_type_hash(bag_path) -> None:
    with (bag_path / "flight_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert schema.encoding == "ros2msg"
        assert channel.message_encoding == "cdr"
        assert channel.metadata["topic_type_hash"] == type_hash(schema.name)
        (offered,) = yaml.safe_load(channel.metadata["offered_qos_profiles"])
        kept = {key: offered[key] for key in ("history", "depth", "reliability", "durability", "deadline")}
        assert kept == {
            "history": "keep_last",
            "depth": 10,
            "reliability": "reliable",
            "durability": "transient_local",
            "deadline": {"sec": 9223372036, "nsec": 854775807},
        }


def test_metadata_yaml_equals_the_record_in_the_file(bag_path, flight) -> None:
    listed = yaml.safe_load((bag_path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    with (bag_path / "flight_0.mcap").open("rb") as stream:
        records = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert yaml.safe_load(records["rosbag2"]["serialized_metadata"]) == listed
    stamps = [message.stamp_ns for message in flight]
    assert listed["version"] == 9
    assert listed["storage_identifier"] == "mcap"
    assert listed["message_count"] == len(flight)
    assert listed["starting_time"]["nanoseconds_since_epoch"] == min(stamps)
    assert listed["duration"]["nanoseconds"] == max(stamps) - min(stamps)
    assert listed["relative_file_paths"] == ["flight_0.mcap"]


def test_stamps_are_simulated_time_alone(bag_path, flight) -> None:
    with (bag_path / "flight_0.mcap").open("rb") as stream:
        messages = [message for _, _, message in make_reader(stream).iter_messages(log_time_order=False)]
    assert [m.log_time for m in messages] == [m.stamp_ns for m in flight]
    assert [m.publish_time for m in messages] == [m.stamp_ns for m in flight]
    assert [m.sequence for m in messages] == list(range(len(flight)))


def test_provenance_and_attachments_are_read_back(tmp_path, write_bag) -> None:
    with BagWriter(
        tmp_path / "run", {"run": {"seed": "7", "note": "ñ"}}, {"scenario.yaml": b"a: 1\n", "x.bin": b""}
    ) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=1)
        writer.add_metadata("misses", {"/deputy1": "3"})
    bag = Bag(tmp_path / "run")
    assert bag.metadata == {"run": {"seed": "7", "note": "ñ"}, "misses": {"/deputy1": "3"}}
    assert bag.attachments == {"scenario.yaml": b"a: 1\n", "x.bin": b""}
    assert bag.topics["/clock"].count == 0


def test_a_bag_without_messages_is_a_bag(tmp_path) -> None:
    BagWriter(tmp_path / "run", {}).close()
    with Reader(tmp_path / "run") as reader:
        assert reader.message_count == 0
    assert list(Bag(tmp_path / "run").messages()) == []


@pytest.mark.parametrize("split", [Split(max_duration=20.0), Split(max_bytes=20_000)])
def test_a_split_bag_keeps_order_and_each_file_is_complete(tmp_path, write_bag, flight, split) -> None:
    path = write_bag(tmp_path / "run", flight, split=split)
    files = sorted(path.glob("*.mcap"))
    listed = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert len(files) > 2
    assert listed["relative_file_paths"] == [f"run_{number}.mcap" for number in range(len(files))]
    assert sum(entry["message_count"] for entry in listed["files"]) == len(flight)
    assert [(t, d, s) for t, d, s in Bag(path).messages()] == [(m.topic, m.data, m.stamp_ns) for m in flight]
    with Reader(path) as reader:
        assert sum(1 for _ in reader.messages()) == len(flight)
    alone = Bag(path / "run_2.mcap")
    assert alone.metadata == {"run": {"seed": "1"}}
    assert set(alone.topics) == {message.topic for message in flight}
    if split.max_duration:
        for entry in listed["files"]:
            assert entry["duration"]["nanoseconds"] < split.max_duration * 1e9
    else:
        # Beyond its limit of messages a file holds at most one more chunk, and some 20 kB for the definitions
        # at its beginning and again, with the index, at its end.
        assert all(file.stat().st_size < 3 * split.max_bytes for file in files)


def test_a_bag_can_be_read_while_it_is_written(tmp_path, write_bag, flight) -> None:
    path = write_bag(tmp_path / "run", flight, close=False)
    listed = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert {topic["topic_metadata"]["name"] for topic in listed["topics_with_message_count"]} == {
        message.topic for message in flight
    }
    bag = Bag(path)
    assert "cut" in bag.damage
    assert list(bag.messages()) == [(m.topic, m.data, m.stamp_ns) for m in flight]
    assert bag.topics["/truth"].count == sum(m.topic == "/truth" for m in flight)


def test_messages_reach_the_disk_without_an_explicit_flush(tmp_path) -> None:
    writer = BagWriter(tmp_path / "run", {})
    writer.add_topic("/count", "std_msgs/msg/UInt64", depth=10)
    data = bytes([0, 1, 0, 0]) + bytes(8)
    writer.write("/count", data, 1, 1)
    time.sleep(1.2 * FLUSH_INTERVAL)
    writer.write("/count", data, 2, 2)
    assert [stamp for _, _, stamp in Bag(tmp_path / "run").messages()] == [1, 2]


WRITES_UNTIL_KILLED = """
import os, struct, sys, time
from pathlib import Path
from formation_gnc.recording.writer import BagWriter

writer = BagWriter(Path(sys.argv[1]), {"run": {"seed": "1"}})
writer.add_topic("/count", "std_msgs/msg/UInt64", depth=10)
told = os.open(sys.argv[2], os.O_CREAT | os.O_WRONLY)
last, longest = time.monotonic_ns(), 0
print(last, flush=True)
while True:  # stamped with wall time, to measure the loss
    now = time.monotonic_ns()
    last, longest = now, max(longest, now - last)
    os.pwrite(told, struct.pack("qq", last, longest), 0)
    writer.write("/count", bytes([0, 1, 0, 0]) + bytes(8), now, 0)
    time.sleep(0.001)
"""


@pytest.mark.parametrize(
    "moment",
    [0.9, *(pytest.param(0.1 * (number + number % 7), marks=pytest.mark.slow) for number in range(20))],
)
@pytest.mark.thorough
def test_a_kill_loses_at_most_what_came_since_a_flush_was_due(tmp_path, moment) -> None:
    """Flushed with the first message after the interval; the longest pause is the machine's, or its disk's."""
    arguments = [sys.executable, "-c", WRITES_UNTIL_KILLED, str(tmp_path / "run"), str(tmp_path / "told")]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    started = int(process.stdout.readline())
    time.sleep(moment)
    process.send_signal(signal.SIGKILL)
    process.wait()
    written, pause = struct.unpack("qq", (tmp_path / "told").read_bytes() or struct.pack("qq", started, 0))
    last = max((stamp for _, _, stamp in Bag(tmp_path / "run").messages()), default=started)
    assert written - last <= FLUSH_INTERVAL * 1e9 + pause
    result = recover(tmp_path / "run", tmp_path / "saved")
    if last == started:
        assert result.status == NOTHING_SAVED
        return
    assert result.status == PARTLY_LOST
    with Reader(tmp_path / "saved") as reader:
        assert max(stamp for _, stamp, _ in reader.messages()) == last
    with (tmp_path / "saved" / "saved_0.mcap").open("rb") as stream:
        assert max(message.log_time for _, _, message in make_reader(stream).iter_messages()) == last


def test_an_existing_directory_is_left_alone(tmp_path) -> None:
    (tmp_path / "run").mkdir()
    with pytest.raises(ConfigurationError, match=r"run: exists already"):
        BagWriter(tmp_path / "run", {})
    assert list((tmp_path / "run").iterdir()) == []


def test_a_directory_that_cannot_be_made_is_named(tmp_path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigurationError, match=r"file/run: cannot be made"):
        BagWriter(tmp_path / "file" / "run", {})


@pytest.mark.parametrize("split", [{"max_bytes": 0}, {"max_duration": -1.0}, {"max_duration": float("nan")}])
def test_a_split_that_cannot_be_kept_is_rejected(split) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(split))):
        Split(**split)


def test_wrong_use_is_rejected_without_effect(tmp_path, flight) -> None:
    writer = BagWriter(tmp_path / "run", {})
    writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=10)
    with pytest.raises(ConfigurationError, match="/clock"):
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=10)
    with pytest.raises(ConfigurationError, match="/truth"):
        writer.write("/truth", b"", 0, 0)
    with pytest.raises(ConfigurationError, match="depth 0"):
        writer.add_topic("/truth", "formation_gnc_msgs/msg/Truth", depth=0)
    with pytest.raises(ConfigurationError, match="stamp -1"):
        writer.write("/clock", flight[0].data, -1, 0)
    writer.write(
        "/clock", flight[0].data, flight[0].stamp_ns, 2**32 + 1
    )  # counts on beyond what the file's 32 bits hold
    writer.close()
    writer.close()
    writer.flush()
    with pytest.raises(ConfigurationError, match="closed"):
        writer.write("/clock", b"", 0, 0)
    assert list(Bag(tmp_path / "run").messages()) == [("/clock", flight[0].data, flight[0].stamp_ns)]


def test_a_full_disk_leaves_the_written_part_readable(tmp_path, flight) -> None:
    # A limit on the file size fails a write in the middle, as a full disk does. (The signal that comes with
    # it is ignored by Python, which leaves EFBIG.)
    script = """
import resource, sys
from pathlib import Path
from formation_gnc.recording.writer import BagWriter

writer = BagWriter(Path(sys.argv[1]), {})
writer.add_topic("/count", "std_msgs/msg/UInt64", depth=10)
resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))
for stamp in range(10**6):
    try:
        scattered = stamp * 0x9E3779B97F4A7C15 % 2**64  # does not compress
        writer.write("/count", bytes([0, 1, 0, 0]) + scattered.to_bytes(8), stamp, stamp)
        if stamp % 500 == 0:
            writer.flush()
    except OSError as error:
        print(error)
        break
writer.close()
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "run")], capture_output=True, text=True, check=True
    )
    assert str(tmp_path / "run") in done.stdout
    assert "File too large" in done.stdout
    assert done.stderr == ""
    stamps = [stamp for _, _, stamp in Bag(tmp_path / "run").messages()]
    assert len(stamps) > 500
    assert stamps == list(range(len(stamps)))
