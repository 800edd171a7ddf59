"""Every command rejects a bad bag in one line."""

import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from formation_gnc.cli import main
from formation_gnc.parameters import dump, to_json
from formation_gnc.recording import Bag
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.provenance import LOST, parameters_record
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

COMMANDS: dict[str, Callable[[Path, Path], list[str]]] = {
    "report": lambda bag, out: ["report", str(bag), "--output", str(out / "report.html")],
    "export": lambda bag, out: ["export", str(bag), "--output", str(out / "tables"), "--attachments"],
    "compare": lambda bag, out: ["compare", str(bag), str(bag)],
    "navigate": lambda bag, out: ["navigate", str(bag)],
    "replay": lambda bag, out: ["replay", str(bag), "--bag", str(out / "again")],
    "recover": lambda bag, out: ["recover", str(bag), "--output", str(out / "saved")],
}


@pytest.fixture(autouse=True)
def _own_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the command sets signal handlers


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole bag of several chunks."""
    directory = tmp_path_factory.mktemp("whole") / "bag"
    run = Run(load_scenario("leader_follower", {"/plant": {"duration": 20.0}}))
    with BagWriter(directory, {"run": {"scenario": "leader_follower"}}, {"a.yaml": b"a: 1\n"}) as writer:
        sink = InProcessRecorder(writer)
        while not run.plant.finished:
            run.tick(sink)
            if run.plant.tick % 5 == 0:
                writer.flush()
    return directory


def retyped(whole: Path, directory: Path, change: Callable[[TopicDefinition], TopicDefinition]) -> Path:
    """Copy of a bag with other definitions, as of another version of the messages."""
    bag = Bag(whole)
    with BagWriter(directory, {}) as writer:
        for topic in bag.topics:
            schema, channel = bag.definition(topic)
            assert schema is not None
            definition = TopicDefinition(schema.name, schema.data, metadata=channel.metadata)
            writer.add_defined_topic(topic, change(definition))
        for number, (topic, data, stamp) in enumerate(bag.messages()):
            writer.write(topic, data, stamp, number)
    return directory


def older(definition: TopicDefinition) -> TopicDefinition:
    """Definition with other names of fields."""
    schema = definition.schema
    for name in (b"mass", b"relative_state", b"readings", b"force", b"iterations", b"kind"):
        schema = schema.replace(b" " + name, b" old_" + name)
    return TopicDefinition(definition.type_name, schema, metadata=definition.metadata)


def foreign(definition: TopicDefinition) -> TopicDefinition:
    return TopicDefinition("other.Message", b"\x0a\x01", schema_encoding="protobuf", message_encoding="protobuf")


def without_schema(path: Path) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/truth", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    return path


@pytest.fixture(scope="module")
def bad(whole: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    directory = tmp_path_factory.mktemp("bad")
    (mcap,) = whole.glob("*.mcap")
    content = mcap.read_bytes()
    (directory / "empty").mkdir()
    (directory / "words.mcap").write_bytes(b"not a bag " * 100)
    (directory / "nothing.mcap").write_bytes(b"")
    (directory / "cut.mcap").write_bytes(content[: len(content) * 2 // 3])
    broken = bytearray(content)
    with mcap.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    middle = summary.chunk_indexes[0].chunk_start_offset + summary.chunk_indexes[0].chunk_length // 2
    broken[middle : middle + 40] = b"\xff" * 40
    (directory / "broken.mcap").write_bytes(broken)
    BagWriter(directory / "silent", {}).close()
    return {
        "a path that is not there": directory / "nowhere",
        "an empty directory": directory / "empty",
        "no bag at all": directory / "words.mcap",
        "a file of no bytes": directory / "nothing.mcap",
        "a bag without messages": directory / "silent",
        "a cut bag": directory / "cut.mcap",
        "a broken chunk": directory / "broken.mcap",
        "another version's messages": retyped(whole, directory / "older", older),
        "unknown schemas": retyped(whole, directory / "foreign", foreign),
        "no schemas": without_schema(directory / "json.mcap"),
    }


KINDS = [
    *("a path that is not there", "an empty directory", "no bag at all", "a file of no bytes"),
    *("a bag without messages", "a cut bag", "a broken chunk"),
    *("another version's messages", "unknown schemas", "no schemas"),
]
WHOLE_ENOUGH = {"a cut bag", "a bag without messages", "another version's messages"}
"""Kinds that some commands accept."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.thorough
def test_a_bad_bag_is_rejected_in_one_line(
    bad: dict[str, Path], command: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main(COMMANDS[command](bad[kind], tmp_path))
    output, errors = capsys.readouterr()
    if command == "recover" and kind not in ("a path that is not there", "an empty directory"):
        assert status in (0, 1, 3)
        assert output
        return
    if status == 0:
        assert kind in WHOLE_ENOUGH
        return
    assert status in (1, 2)
    assert errors.count("\n") == 1, errors
    assert errors.startswith("formation-gnc: ")
    assert bad[kind].name in errors or status == 1


@pytest.mark.parametrize("command", ["export", "compare", "navigate", "replay", "recover"])
# test_recover sweeps all bytes.
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_truncated_and_flipped_bytes_never_raise_a_traceback(
    whole: Path, tmp_path: Path, command: str, data: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    (mcap,) = whole.glob("*.mcap")
    content = bytearray(mcap.read_bytes())
    for at in data.draw(st.lists(st.integers(0, len(content) - 1), max_size=3)):
        content[at] ^= data.draw(st.integers(1, 255))
    del content[data.draw(st.integers(len(content) // 4, len(content))) :]
    directory = tmp_path / "case"
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir()
    (directory / "bag.mcap").write_bytes(content)
    capsys.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # damaged numbers may overflow on the way to a figure
        status = main(COMMANDS[command](directory / "bag.mcap", directory))
    assert status in (0, 1, 2, 3)
    assert capsys.readouterr().err.count("\n") <= 1


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag with the parameters of its nodes."""
    scenario = load_scenario("leader_follower", {"/plant": {"duration": 20.0}})
    modules = {f"/deputy1/{name}": each for name, each in scenario.deputies["deputy1"].items()}
    metadata = {
        parameters_record(node): {name: to_json(value) for name, value in dump(values).items()}
        for node, values in ({"/plant": scenario.plant} | modules).items()
    }
    directory = tmp_path_factory.mktemp("flown") / "bag"
    with BagWriter(directory, metadata) as writer:
        Run(scenario).fly(InProcessRecorder(writer))
    return directory


def with_misfit(whole: Path, directory: Path, topic: str) -> Path:
    """Copy of a bag with a message in the midst of a topic whose counts lead beyond its end, of the usual length."""
    bag = Bag(whole)
    with BagWriter(directory, bag.metadata, bag.attachments) as writer:
        for name in bag.topics:
            writer.add_defined_topic(name, TopicDefinition.recorded(*bag.definition(name)))
        seen = 0
        for number, (name, data, stamp) in enumerate(bag.messages()):
            seen += name == topic
            broken = data[:12] + b"\xff\xff\xff\x7f" + data[16:]  # the length of the header's frame
            writer.write(name, broken if name == topic and seen == 11 else data, stamp, number)
    return directory


@pytest.mark.parametrize("topic", ["/deputy1/estimate", "/truth"])
@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "report"])
def test_a_message_that_does_not_fit_is_named_with_its_place_the_rest_used(
    flown: Path, command: str, topic: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = with_misfit(flown, tmp_path / "misfit", topic)
    (tmp_path / "out").mkdir()
    status = main(COMMANDS[command](bag, tmp_path / "out"))
    output, errors = capsys.readouterr()
    differs = (command, topic) == ("replay", "/deputy1/estimate")  # which is flown again, and was not readable
    assert status == (3 if command == "recover" else 1 if differs else 0), errors
    assert f"messages of {topic}" in output
    assert "message 11 of the topic" in output
    assert "10 s" in output


def test_verify_finds_a_message_that_does_not_fit_and_writes_nothing(whole: Path, tmp_path: Path) -> None:
    bag = with_misfit(whole, tmp_path / "misfit", "/deputy1/thrust")
    before = sorted(tmp_path.rglob("*"))
    assert main(["recover", "--verify", str(bag)]) == 3
    assert main(["recover", "--verify", str(whole)]) == 0
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "report"])
def test_a_recorded_parameter_altered_in_the_file_is_not_believed(
    whole: Path, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (mcap,) = whole.glob("*.mcap")
    content = mcap.read_bytes()
    assert b"leader_follower" in content
    (tmp_path / "altered.mcap").write_bytes(content.replace(b"leader_follower", b"leader_fallower", 1))
    status = main(COMMANDS[command](tmp_path / "altered.mcap", tmp_path))
    output, errors = capsys.readouterr()
    assert "checksum of its data section is wrong" in output + errors
    assert status == (3 if command == "recover" else 2)


@pytest.mark.parametrize("count", ["many", "-3", "1e9", "9" * 6000, "\N{SUPERSCRIPT TWO}", ""])
def test_a_count_of_lost_messages_that_is_no_number_is_said(whole: Path, tmp_path: Path, count: str) -> None:
    with BagWriter(tmp_path / "bag", {LOST: {"/truth": count, "/clock": "2"}}):
        pass
    bag = Bag(tmp_path / "bag")
    assert bag.lost == 2
    assert any("lost is not known of /truth" in remark and len(remark) < 200 for remark in bag.remarks)
