"""What killed processes left is removed at the next start; what somebody uses, or may yet, stays."""

import fcntl
import os
from pathlib import Path

import pytest

from formation_gnc.transport import leftovers
from formation_gnc.transport.leftovers import NEW, folder_prefix, sweep

NOBODY = 2**22 + 1
"""Beyond the greatest process number that Linux gives."""


def old(path: Path) -> Path:
    time = path.stat().st_mtime - 2.0 * NEW
    os.utime(path, (time, time))
    return path


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Shared memory and folder of temporary files."""
    memory, temporary = tmp_path / "shm", tmp_path / "tmp"
    memory.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(leftovers, "SHARED_MEMORY", memory)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(temporary))
    return memory, temporary


def test_segments_go_unless_a_process_has_them_locked_or_has_just_begun(places: tuple[Path, Path]) -> None:
    memory, _ = places
    for name in ("fastrtps_dead", "fastrtps_live", "fastrtps_new", "fastrtps_port7400", "others"):
        for path in (memory / name, memory / f"{name}_el"):
            path.write_bytes(b"")
            if name != "fastrtps_new":
                old(path)
    with (memory / "fastrtps_live_el").open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        assert sweep() == [memory / "fastrtps_dead"]
    left = {path.name.removesuffix("_el") for path in memory.iterdir()}
    assert left == {"fastrtps_live", "fastrtps_new", "fastrtps_port7400", "others"}


def test_folders_go_whose_process_is_gone(places: tuple[Path, Path]) -> None:
    _, temporary = places
    dead, live, other = (
        temporary / f"formation_gnc-{NOBODY}-a",
        temporary / f"{folder_prefix()}b",
        temporary / "other-1-c",
    )
    for folder in (dead, live, other):
        folder.mkdir()
        (folder / "plant.log").write_text("")
        old(folder)
    assert sweep() == [dead]
    assert sorted(temporary.iterdir()) == sorted([live, other])
