"""What processes that were killed have left behind: shared memory of the middleware, folders of launchers.

Only what nobody uses is removed. Fast DDS locks a file beside each of its segments for as long as the segment's
process lives; a launcher's folder has its process number in its name.
"""

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")

LOCK = "_el"
"""What the name of a segment's lock file ends with."""

FOLDER = "formation_gnc-"
"""What the names of temporary folders begin with, before the number of their process."""

NEW = 60.0
"""Age (s) below which something is left alone: its process may not have locked it yet."""


def folder_prefix() -> str:
    """What the name of a temporary folder of this process begins with."""
    return f"{FOLDER}{os.getpid()}-"


def sweep() -> list[Path]:
    """Remove what dead processes of this user have left; returns what was removed."""
    temporary = Path(tempfile.gettempdir())
    return [*_swept_segments(SHARED_MEMORY), *_swept_folders(temporary)]


def _swept_segments(directory: Path) -> Iterator[Path]:
    for lock in directory.glob(f"fastrtps_*{LOCK}"):
        segment = lock.with_name(lock.name.removesuffix(LOCK))
        with suppress(OSError):
            if _is_own_and_old(lock) and "port" not in lock.name and _is_unlocked(lock):
                segment.unlink(missing_ok=True)
                lock.unlink()
                yield segment


def _swept_folders(directory: Path) -> Iterator[Path]:
    for folder in directory.glob(f"{FOLDER}*-*"):
        number = folder.name.removeprefix(FOLDER).partition("-")[0]
        with suppress(OSError):
            if number.isdecimal() and _is_own_and_old(folder) and not Path(f"/proc/{number}").exists():
                shutil.rmtree(folder)
                yield folder


def _is_own_and_old(path: Path) -> bool:
    status = path.stat()
    return status.st_uid == os.getuid() and time.time() - status.st_mtime > NEW


def _is_unlocked(path: Path) -> bool:
    """Whether no process holds a lock on a file; raises OSError where one does."""
    with path.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return True
