"""Files from anywhere: a pipe or a device could be read for ever, and no file of ours is as long as some."""

import errno
from pathlib import Path

LARGEST = 16_000_000
"""Most bytes of a file that is read as a whole: sixteen times what YAML may have."""


def check_plain(path: Path) -> None:
    """Raise OSError for what is there and is neither a regular file nor a directory."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "Is no regular file", str(path))


def read_plain(path: Path) -> bytes:
    """Contents of a regular file.

    Raises:
        OSError: it cannot be read, is no regular file, or is larger than 16 MB.
    """
    check_plain(path)
    with path.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise OSError(errno.EFBIG, f"Is larger than {LARGEST // 1_000_000} MB", str(path))
    return content
