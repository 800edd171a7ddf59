"""The recorder's bag: deleted while it records, or there before it starts."""

import shutil
from pathlib import Path

import pytest

from formation_gnc.recording.provenance import provenance
from formation_gnc.recording.writer import BagWriter
from formation_gnc.transport.presence import Presence
from formation_gnc.transport.recorder_node import RecorderNode, free_directory

from .conftest import Bench


def test_a_deleted_bag_is_noticed_at_the_next_flush(tmp_path: Path) -> None:
    bag = BagWriter(tmp_path / "bag", provenance(), {})
    bag.add_topic("/x", "std_msgs/msg/String", 1)
    shutil.rmtree(tmp_path / "bag")
    bag.write("/x", b"\0\1\0\0\1\0\0\0\0", 0, 1)
    with pytest.raises(OSError, match="deleted"):
        bag.flush()


def test_a_recorder_goes_on_in_the_next_directory_that_is_free(tmp_path: Path) -> None:
    wanted = tmp_path / "bag"
    assert free_directory(wanted) == wanted
    wanted.mkdir()
    assert free_directory(wanted) == wanted, "no bag: the writer refuses it"
    (wanted / "bag_0.mcap").touch()
    assert free_directory(wanted) == tmp_path / "bag_2"
    (tmp_path / "bag_2").mkdir()
    assert free_directory(wanted) == tmp_path / "bag_3"


@pytest.mark.sil
def test_a_process_that_ends_is_gone_at_once_and_one_never_seen_is_not(bench: Bench) -> None:
    recorder = bench.make("recorder")
    assert isinstance(recorder, RecorderNode)
    presence = Presence(bench.user)
    assert not presence.is_gone("/elsewhere")
    assert not presence.is_gone("/recorder")
    assert recorder._presence is not None
    recorder._presence.close()  # as the kernel does
    assert presence.is_gone("/recorder")
    assert not presence.is_gone("/elsewhere")
