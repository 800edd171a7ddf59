"""Structured mutations of the records of a flight's MCAP file: every command answers in at most one line."""

import shutil
import warnings
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from formation_gnc.cli import main
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

COMMANDS: dict[str, list[str]] = {
    "report": ["report", "BAG", "--output", "OUT/report.html"],
    "export": ["export", "BAG", "--output", "OUT/tables"],
    "compare": ["compare", "BAG", "BAG"],
    "navigate": ["navigate", "BAG"],
    "replay": ["replay", "BAG", "--bag", "OUT/again"],
    "recover": ["recover", "BAG", "--output", "OUT/saved"],
}

Messages = list[tuple[str, bytes, int]]
"""Topic, data and log time, ns."""

STAMPS = st.sampled_from([0, 1, 10**9, 5 * 10**9, 2**31 * 10**9, 2**63 - 1, 2**63 + 5, 2**64 - 1])


@pytest.fixture(autouse=True)
def _own_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the command sets signal handlers


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, tuple[str, bytes]], Messages, dict[str, Any]]:
    """Types by topic, messages and metadata of a short flight."""
    directory = tmp_path_factory.mktemp("recorded") / "bag"
    with BagWriter(directory, {"run": {"scenario": "leader_follower"}}) as writer:
        Run(load_scenario("leader_follower", {"/plant": {"duration": 12.0}})).fly(InProcessRecorder(writer))
    with next(directory.glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream)
        found = [
            (channel.topic, schema.name, schema.data, message.data, message.log_time)
            for schema, channel, message in reader.iter_messages()
            if schema is not None
        ]
        metadata = {record.name: dict(record.metadata) for record in reader.iter_metadata()}
    kinds = {topic: (name, text) for topic, name, text, _, _ in found}
    return kinds, [(topic, data, stamp) for topic, _, _, data, stamp in found], metadata


def changed(data: Any, message: tuple[str, bytes, int], topics: list[str]) -> list[tuple[str, bytes, int]]:
    """What a message becomes."""
    topic, content, stamp = message
    if not content:
        return []
    at = data.draw(st.integers(0, len(content) - 1))
    flipped = content[:at] + bytes([content[at] ^ data.draw(st.integers(1, 255))]) + content[at + 1 :]
    kind = data.draw(st.sampled_from(["drop", "twice", "flip", "cut", "long", "topic", "stamp", "empty", "sequence"]))
    return {
        "drop": [],
        "twice": [message, message],
        "flip": [(topic, flipped, stamp)],
        "cut": [(topic, content[:at], stamp)],
        "long": [(topic, content + bytes(at), stamp)],
        "topic": [(data.draw(st.sampled_from(topics)), content, stamp)],
        "stamp": [(topic, content, data.draw(STAMPS))],
        "empty": [(topic, b"", stamp)],
        "sequence": [(topic, content[:at] + b"\xff\xff\xff\x7f" + content[at + 4 :], stamp)],
    }[kind]


def mutated(data: Any, messages: Messages, topics: list[str]) -> Messages:
    """Messages changed one by one, and moved, lost or repeated as a block."""
    result: Messages = list(messages)
    for _ in range(data.draw(st.integers(0, 4))):
        at = data.draw(st.integers(0, len(result) - 1))
        result[at : at + 1] = changed(data, result[at], topics)
    start, length = data.draw(st.integers(0, len(result))), data.draw(st.integers(0, 40))
    block = result[start : start + length]
    kind = data.draw(st.sampled_from(["stay", "lose", "repeat", "move", "reverse"]))
    if kind in ("lose", "move"):
        del result[start : start + length]
    if kind in ("repeat", "move"):
        at = data.draw(st.integers(0, len(result)))
        result[at:at] = block
    return result[::-1] if kind == "reverse" else result


def write(path: Path, data: Any, kinds: dict[str, tuple[str, bytes]], messages: Messages, metadata: Any) -> None:
    """Write the messages with a summary, encodings and types as drawn."""
    options = {name: data.draw(st.booleans()) for name in ("repeat_channels", "repeat_schemas", "use_statistics")}
    compression = data.draw(st.sampled_from(list(CompressionType)))
    swapped = data.draw(st.sampled_from(sorted(kinds)))
    other = data.draw(st.sampled_from(sorted(kinds)))
    encoding = data.draw(st.sampled_from(["cdr", "cdr", "json", ""]))
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=4000, **options)
        writer.start(profile="ros2")
        for name, values in metadata.items():
            writer.add_metadata(name, values)
        channels = {}
        for topic in kinds:
            name, text = kinds[other if topic == swapped else topic]
            schema = data.draw(st.integers(0, 9)) and writer.register_schema(name, "ros2msg", text)
            channels[topic] = writer.register_channel(topic, encoding if topic == swapped else "cdr", schema)
        for topic, content, stamp in messages:
            writer.add_message(channels[topic], stamp, content, stamp)
        writer.finish()


@pytest.mark.parametrize("command", COMMANDS)
@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
@pytest.mark.thorough
def test_mutated_records_never_raise_a_traceback(
    recorded: Any, tmp_path: Path, command: str, data: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    kinds, messages, metadata = recorded
    directory = tmp_path / "case"
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir()
    write(directory / "bag.mcap", data, kinds, mutated(data, messages, sorted(kinds)), metadata)
    words = [word.replace("BAG", str(directory / "bag.mcap")) for word in COMMANDS[command]]
    capsys.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # damaged numbers may overflow on the way to a figure
        status = main([word.replace("OUT", str(directory)) for word in words])
    assert status in (0, 1, 2, 3)
    assert capsys.readouterr().err.count("\n") <= 1
