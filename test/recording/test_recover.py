"""Recovery of bags cut and damaged at random: nothing that can be read is lost, nothing is made up."""

import math
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording import Bag
from formation_gnc.recording.recover import NOTHING_SAVED, PARTLY_LOST, WHOLE, recover
from formation_gnc.recording.writer import BagWriter

PROVENANCE = {"run": {"seed": "1", "scenario": "leader_follower"}}
ATTACHMENTS = {"scenario.yaml": b"plant: {seed: 1}\n" * 20}


class Messages(list):
    """Messages of a bag; prints as their number, not as a page of bytes."""

    def __repr__(self) -> str:
        return f"<{len(self)} messages>"


on_one_file = settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def only_asked_for_flushes():
    """No chunk ends by wall time, however busy the machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("formation_gnc.recording.writer.FLUSH_INTERVAL", math.inf)
        yield


@pytest.fixture(scope="module")
def log(tmp_path_factory, flight, only_asked_for_flushes):
    """A finished file of eight chunks, its messages, and where each of its chunks begins and ends."""
    directory = tmp_path_factory.mktemp("recover") / "run"
    flight = flight[: len(flight) // 2]
    per_chunk = len(flight) // 8 + 1
    with BagWriter(directory, PROVENANCE, ATTACHMENTS) as writer:
        for topic, type_name in dict.fromkeys((m.topic, m.type_name) for m in flight):
            writer.add_topic(topic, type_name, depth=10)
        for sequence, message in enumerate(flight):
            writer.write(message.topic, message.data, message.stamp_ns, sequence)
            if sequence % per_chunk == per_chunk - 1:
                writer.flush()
    path = directory / "run_0.mcap"
    with path.open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    spans = [(chunk.chunk_start_offset, chunk.chunk_start_offset + chunk.chunk_length) for chunk in chunks]
    assert len(spans) >= 8
    return path, Messages((m.topic, m.data, m.stamp_ns) for m in flight), spans


@pytest.fixture
def damaged(tmp_path):
    """Recover given bytes from a fresh bag directory."""

    def run(data: bytes):
        shutil.rmtree(tmp_path, ignore_errors=True)
        (tmp_path / "log").mkdir(parents=True)
        (tmp_path / "log" / "log_0.mcap").write_bytes(data)
        result = recover(tmp_path / "log", tmp_path / "saved")
        messages = Messages(Bag(result.output).messages() if result.output else [])
        assert len(messages) == (result.saved if result.output else 0), (Bag(result.output).remarks, result)
        return result, messages

    return run


def is_part_of(part: list, whole: list) -> bool:
    """Whether the first is the second with some left out."""
    rest = iter(whole)
    return all(item in rest for item in part)


def test_a_whole_bag_is_left_alone(log, tmp_path) -> None:
    path, messages, _ = log
    result = recover(path.parent, tmp_path / "saved")
    assert (result.status, result.output, result.saved) == (WHOLE, None, len(messages))
    assert not (tmp_path / "saved").exists()


def test_a_bag_cut_in_its_index_is_recovered_whole(log, damaged, tmp_path) -> None:
    path, messages, _ = log
    result, saved = damaged(path.read_bytes()[:-30])
    assert (result.status, result.reasons, result.lost) == (WHOLE, (), {})
    assert saved == messages
    with Reader(tmp_path / "saved") as reader:  # by another's index reader
        assert sum(1 for _ in reader.messages()) == len(messages)


@on_one_file
@given(st.data())
@pytest.mark.thorough
def test_a_cut_loses_at_most_its_chunk(log, damaged, data) -> None:
    path, messages, spans = log
    content = path.read_bytes()
    cut = data.draw(st.integers(0, len(content) - 1))
    result, saved = damaged(content[:cut])
    assert saved == Messages(messages[: len(saved)])
    whole_chunks = sum(end <= cut for _, end in spans)
    per_chunk = len(messages) // 8 + 1
    assert len(saved) >= min(len(messages), whole_chunks * per_chunk)
    assert result.status == (NOTHING_SAVED if not saved else PARTLY_LOST if result.reasons else WHOLE)
    if result.output:
        bag = Bag(result.output)
        assert bag.damage is None
        assert bag.metadata["run"] == PROVENANCE["run"]
        assert bag.attachments == ATTACHMENTS


@on_one_file
@given(st.data())
@pytest.mark.thorough
def test_a_flipped_byte_is_detected_and_spares_the_other_chunks(log, damaged, data) -> None:
    path, messages, spans = log
    content = bytearray(path.read_bytes())
    # Beyond the first chunk, which alone holds the definitions when the index is gone too.
    at = data.draw(st.integers(spans[1][0], len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    result, saved = damaged(bytes(content))
    per_chunk = len(messages) // 8 + 1
    intact = [
        message
        for number, (start, end) in enumerate(spans)
        if not start <= at < end
        for message in messages[number * per_chunk : (number + 1) * per_chunk]
    ]
    assert is_part_of(intact, saved if result.output else messages)
    if result.status == WHOLE:
        assert saved == messages or result.output is None
        if result.output:
            bag = Bag(result.output)
            assert bag.metadata["run"] == PROVENANCE["run"]
            assert bag.attachments == ATTACHMENTS
    else:
        assert result.reasons
    if not any("unverified" in reason for reason in result.reasons):
        assert is_part_of(saved, messages)


@on_one_file
@given(st.data())
@pytest.mark.thorough
def test_any_damage_ends_in_a_status(log, damaged, data) -> None:
    path, _, _ = log
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 20))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 9))] = data.draw(st.binary(max_size=9))
        content = content or bytearray(1)
    result, _ = damaged(bytes(content))
    assert result.status in (WHOLE, NOTHING_SAVED, PARTLY_LOST)
    assert result.status == WHOLE or result.reasons


def test_a_broken_chunk_is_saved_up_to_the_break(log, damaged) -> None:
    path, messages, spans = log
    content = bytearray(path.read_bytes())
    start, end = spans[3]
    middle = start + (end - start) * 2 // 3
    content[middle : middle + 64] = b"\xff" * 64
    result, saved = damaged(bytes(content))
    per_chunk = len(messages) // 8 + 1
    assert result.status == PARTLY_LOST
    assert sum(result.lost.values()) == len(messages) - len(saved)
    assert 0 <= sum(result.lost.values()) < per_chunk
    assert any(f"chunk at byte {start}" in reason for reason in result.reasons)


def test_a_chunk_with_a_wrong_checksum_is_saved_unverified(log, damaged) -> None:
    path, messages, spans = log
    content = bytearray(path.read_bytes())
    content[spans[2][0] + 9 + 24] ^= 1  # the checksum stands after the two stamps and the size
    result, saved = damaged(bytes(content))
    assert result.status == PARTLY_LOST
    assert saved == messages
    assert "unverified" in result.reasons[0]


def test_the_recovered_bag_names_the_damage(log, damaged) -> None:
    path, _, spans = log
    result, _ = damaged(path.read_bytes()[: spans[4][1] - 7])
    recorded = Bag(result.output).metadata["recovery"]
    assert recorded["reasons"] == "\n".join(result.reasons)
    assert "not closed" in recorded["reasons"]


def test_a_lost_definition_is_reported(log, damaged) -> None:
    path, _, spans = log
    content = path.read_bytes()
    # Without its first chunk and its index, the file has no definitions left.
    result, saved = damaged(content[: spans[0][0]] + content[spans[1][0] : spans[-1][1]])
    assert result.status == NOTHING_SAVED
    assert sum(result.lost.values()) > 0
    assert any("definition" in reason for reason in result.reasons)
    assert not saved


def test_split_bags_are_joined_and_a_missing_file_is_reported(tmp_path, write_bag, flight) -> None:
    from formation_gnc.recording.writer import Split

    path = write_bag(tmp_path / "run", flight, split=Split(max_duration=30.0))
    files = sorted(path.glob("*.mcap"))
    last = files[-1].read_bytes()
    files[-1].write_bytes(last[: len(last) // 2])
    files[1].unlink()
    result = recover(path, tmp_path / "saved")
    stamps = [stamp for _, _, stamp in Bag(tmp_path / "saved").messages()]
    assert result.status == PARTLY_LOST
    assert any("run_1.mcap: is missing" in reason for reason in result.reasons)
    assert all(earlier <= later for earlier, later in pairwise(stamps))
    assert not any(30.5e9 <= stamp < 60.5e9 for stamp in stamps)
    assert min(stamps) == flight[0].stamp_ns


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"words" * 1000])
def test_a_file_with_nothing_to_save_has_a_reason(damaged, content) -> None:
    result, _ = damaged(content)
    assert result.status == NOTHING_SAVED
    assert result.output is None
    assert result.reasons


def test_wrong_paths_are_rejected(log, tmp_path) -> None:
    path, _, spans = log
    with pytest.raises(ConfigurationError, match="no such bag"):
        recover(tmp_path / "none", tmp_path / "saved")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: spans[2][1]])
    Path(tmp_path / "saved").mkdir()
    with pytest.raises(ConfigurationError, match="exists already"):
        recover(cut, tmp_path / "saved")
