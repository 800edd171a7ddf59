from pathlib import Path

from formation_gnc.messages.conversion import to_cdr
from formation_gnc.recording import Bag
from formation_gnc.recording.snapshot import Snapshot
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Clock
from formation_gnc.types import NANOSECONDS


def test_each_trigger_writes_the_last_duration_to_a_new_file(tmp_path, flight) -> None:
    writer = BagWriter(tmp_path / "run", {})
    for topic, type_name in dict.fromkeys((message.topic, message.type_name) for message in flight):
        writer.add_topic(topic, type_name, depth=10)
    snapshot = Snapshot(writer, 20.0)
    written = []
    for number, message in enumerate(flight):
        snapshot.write(message.topic, message.data, message.stamp_ns, number)
        if message.topic == "/clock" and message.stamp_ns in (50_500_000_000, 60_500_000_000):
            written.append(snapshot.trigger())
    writer.close()
    spans = [(30.5, 50.5), (50.5, 60.5)]  # contiguous, without overlap
    for file, (first, last), count in zip(("run_0", "run_1"), spans, written, strict=True):
        bag = Bag(tmp_path / "run" / f"{file}.mcap")
        assert (bag.start_ns, bag.end_ns) == ((first + (file == "run_0")) * 1e9, last * 1e9)
        assert sum(topic.count for topic in bag.topics.values()) == count
    kept = [(topic, data) for topic, data, _ in Bag(tmp_path / "run").messages()]
    sent = [(m.topic, m.data) for m in flight]
    first = sent.index(kept[0])
    assert kept == sent[first : first + len(kept)], "contiguous"


def test_nothing_is_written_without_a_trigger(tmp_path, flight) -> None:
    with BagWriter(tmp_path / "run", {}) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=10)
        snapshot = Snapshot(writer, 20.0)
        snapshot.write("/clock", flight[0].data, 1, 1)
    assert Bag(tmp_path / "run").topics["/clock"].count == 0


def kept_of(directory: Path, stamps: list[tuple[str, int]]) -> tuple[int, int, int]:
    """How many messages are kept of these, and their first and last stamp, s."""
    with BagWriter(directory, {}) as writer:
        for topic in ("/clock", "/late"):
            writer.add_topic(topic, "rosgraph_msgs/msg/Clock", depth=10)
        snapshot = Snapshot(writer, 20.0)
        for sequence, (topic, second) in enumerate(stamps):
            stamp = second * NANOSECONDS
            snapshot.write(topic, to_cdr(Clock(stamp)), stamp, sequence)
        count = snapshot.trigger()
        snapshot.write("/late", to_cdr(Clock(0)), 0, len(stamps))  # with nothing kept before
    bag = Bag(directory)
    return count, bag.start_ns // NANOSECONDS, bag.end_ns // NANOSECONDS


def test_a_late_message_expires_by_its_stamp(tmp_path) -> None:
    stamps = [("/clock", second) for second in range(100)]
    long_ago = [*stamps[:90], ("/late", 3), *stamps[90:]]
    just_over = [*stamps[:81], ("/late", 79), *stamps[81:]]
    assert kept_of(tmp_path / "run", stamps) == (20, 80, 99)
    assert kept_of(tmp_path / "late", long_ago) == (20, 80, 99)
    assert kept_of(tmp_path / "over", just_over) == (20, 80, 99)


def test_a_restarted_run_is_kept_as_long_as_the_first(tmp_path) -> None:
    stamps = [("/clock", second) for second in [*range(100), *range(50)]]
    assert kept_of(tmp_path / "run", stamps) == (20, 30, 49)
