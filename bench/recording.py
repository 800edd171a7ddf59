"""The bag writer beside the bare MCAP writer on the same bytes, and a report of a million messages."""

import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from time import perf_counter

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory

from bench.result import Result, interleaved
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.recording.writer import CHUNK_BYTES, BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.types import NANOSECONDS

TICKS = 2000
MESSAGES = 200_000
"""Written by either writer in a round."""

LONG = 1_000_000
"""Messages of the bag that is reported."""

ROUNDS = 5

_HEADER, _STAMP = 4, struct.Struct("<iI")
"""Bytes before the stamp that a message begins with, and its form: s and ns."""

Message = tuple[str, bytes, int]
Definitions = dict[str, TopicDefinition]

REPORT = """
import re, sys
from pathlib import Path
from time import perf_counter
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.report import write_report
from formation_gnc.recording.reader import Bag

started = perf_counter()
bag = Bag(sys.argv[1])
write_report(bag, RunHistory(bag), Path(sys.argv[1]) / "report.html", "bench")
# not ru_maxrss, which begins at that of the process before exec
peak = int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1])
print(perf_counter() - started, peak / 1024)
"""


def flight(directory: Path) -> tuple[Definitions, list[Message]]:
    """Messages of the default scenario, and their topics' definitions."""
    scenario = load_scenario("leader_follower", {"/plant": {"duration": float(TICKS)}})
    with BagWriter(directory, {}) as writer:
        Run(scenario).fly(InProcessRecorder(writer))
    bag = Bag(directory)
    definitions = {}
    for topic in bag.topics:
        schema, channel = bag.definition(topic)
        assert schema is not None
        definitions[topic] = TopicDefinition(schema.name, schema.data, metadata=channel.metadata)
    return definitions, [message for message in bag.messages() if message[0] != "/events"]


def again(messages: list[Message]) -> Iterator[Message]:
    """The flight over and over, each time later, also by the stamp that every message begins with."""
    begin = 0
    while True:
        for topic, data, stamp in messages:
            seconds, nanoseconds = _STAMP.unpack_from(data, _HEADER)
            later = _STAMP.pack(seconds + begin, nanoseconds)
            yield topic, data[:_HEADER] + later + data[_HEADER + _STAMP.size :], begin * NANOSECONDS + stamp
        begin += TICKS  # of a second


def record(path: Path, definitions: Definitions, messages: Iterator[Message]) -> float:
    """Messages per second by the bag writer, through its end."""
    with BagWriter(path, {}) as writer:
        for topic, definition in definitions.items():
            writer.add_defined_topic(topic, definition)
        started = perf_counter()
        count = 0
        for count, (topic, data, stamp) in enumerate(messages, 1):
            writer.write(topic, data, stamp, count)
    rate = count / (perf_counter() - started)
    recorded = sum(topic.count for topic in Bag(path).topics.values())
    assert recorded == count, f"{count - recorded} messages are lost"
    return rate


def write(path: Path, definitions: Definitions, messages: Iterator[Message]) -> float:
    """Messages per second by the bare writer with the same chunks, through its end."""
    with path.open("wb") as stream:
        writer = Writer(stream, CHUNK_BYTES, CompressionType.ZSTD, enable_data_crcs=True)
        writer.start("ros2")
        channels = {}
        for topic, definition in definitions.items():
            schema = writer.register_schema(definition.type_name, "ros2msg", definition.schema)
            channels[topic] = writer.register_channel(topic, "cdr", schema, dict(definition.metadata))
        started = perf_counter()
        count = 0
        for count, (topic, data, stamp) in enumerate(messages, 1):
            writer.add_message(channels[topic], stamp, data, stamp, count)
        writer.finish()
    return count / (perf_counter() - started)


def decode(path: Path) -> float:
    """Seconds in which mcap-ros2-support decodes every message of a bag."""
    started = perf_counter()
    with next(path.glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _ in reader.iter_decoded_messages(log_time_order=False):
            pass
    return perf_counter() - started


def report(path: Path) -> tuple[float, float]:
    """Seconds and peak memory (MB) of a process that writes a bag's report."""
    answer = subprocess.run([sys.executable, "-c", REPORT, str(path)], capture_output=True, text=True, check=True)
    seconds, megabytes = map(float, answer.stdout.split())
    return seconds, megabytes


def run() -> list[Result]:
    """All figures of recording."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        definitions, messages = flight(directory / "flight")
        numbers = iter(range(10**6))

        flown = list(islice(again(messages), MESSAGES))

        def with_ours() -> float:
            return record(directory / f"{next(numbers)}", definitions, iter(flown))

        def with_theirs() -> float:
            return write(directory / f"{next(numbers)}.mcap", definitions, iter(flown))

        ours, theirs = interleaved([with_ours, with_theirs], ROUNDS)
        bags = {count: directory / f"bag_{count}" for count in (LONG // 10, LONG)}
        for count, path in bags.items():
            record(path, definitions, islice(again(messages), count))
        short, long = map(report, bags.values())
        decoded = 10.0 * decode(bags[LONG // 10])
    return [
        Result("recording against the bare MCAP writer", ours, theirs, "messages/s", ours / theirs, ">= 0.8"),
        Result(
            "report of 1e6 messages against decoding them with mcap-ros2-support",
            long[0],
            decoded,
            "s",
            long[0] / decoded,
            "<= 1",
        ),
        Result(
            "peak memory of that report against one of 1e5 messages",
            long[1],
            short[1],
            "MB",
            long[1] / short[1],
            "<= 1.5",
        ),
    ]
