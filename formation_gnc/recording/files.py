"""Files of a bag: MCAP or sqlite3, plain or compressed as rosbag2 does it, in one directory or alone."""

import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import yaml
import zstandard

from formation_gnc.errors import BagError
from formation_gnc.limited_yaml import load_limited
from formation_gnc.plain_file import check_plain, read_plain
from formation_gnc.recording.mcap_file import LARGEST_CHUNK, McapFile, file_number
from formation_gnc.recording.stored_file import StoredFile

COMPRESSED = ".zstd"
SUFFIXES = (".mcap", ".db3")

UNPACKED = 200
"""Times its size that a file may unpack to."""

_SQLITE = b"SQLite format 3\0"
_ZSTD = b"\x28\xb5\x2f\xfd"


def bag_files(path: Path) -> list[Path]:
    """Files of a bag (a directory or a single file) in order of the number at the end of their names.

    Raises:
        BagError: there is no such bag, or its directory holds no file of one.
    """
    if not path.is_dir():
        if not path.exists():
            raise BagError(f"{path}: no such bag")
        return [_plain(path)]
    files = [file for file in path.iterdir() if Path(file.name.removesuffix(COMPRESSED)).suffix in SUFFIXES]
    if not files:
        raise BagError(f"{path}: holds no .mcap or .db3 file")
    return sorted(map(_plain, files), key=lambda file: (file_number(file.name.partition(".")[0]), file.name))


def _plain(path: Path) -> Path:
    """A path, of what can be read to its end."""
    try:
        check_plain(path)
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from None
    if path.suffix == ".db3" and _has_views(path):
        raise BagError(f"{path}: has views, which can be without end; a bag has tables alone")
    return path


def _has_views(path: Path) -> bool:
    """Whether a sqlite3 file has tables that are made up as they are read."""
    with suppress(sqlite3.Error), closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
        return bool(database.execute("SELECT name FROM sqlite_master WHERE type = 'view'").fetchall())
    return False


def digest_of(path: Path) -> str:
    """SHA-256 of the files of a bag one after the other, in hexadecimal; of a single one, that of `sha256sum`.

    Raises:
        BagError: there is no such bag.
    """
    digest = sha256()
    for file in bag_files(path):
        with file.open("rb") as stream:
            while part := stream.read(1 << 20):
                digest.update(part)
    return digest.hexdigest()


def missing_files(path: Path) -> list[str]:
    """A line for each file that the bag's metadata.yaml lists and the directory lacks."""
    names = _metadata(path).get("relative_file_paths")
    listed = [Path(str(name)).name for name in names] if isinstance(names, list) else []
    return [f"{path / name}: is missing" for name in listed if not (path / name).exists()]


def open_files(path: Path) -> list[StoredFile]:
    """Open all files of a bag.

    Raises:
        BagError: there is no such bag, or one of its files cannot be read.
    """
    return [_open(file, unpacker(path)) for file in bag_files(path)]


def unpacker(path: Path) -> Callable[[bytes], bytes] | None:
    """What decompresses each message of a bag, by its metadata.yaml; None where they are not compressed."""
    return _decompressed if str(_metadata(path).get("compression_mode", "")).upper() == "MESSAGE" else None


def _open(path: Path, unpack: Callable[[bytes], bytes] | None) -> StoredFile:
    try:
        with path.open("rb") as stream:
            start = stream.read(len(_SQLITE))
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from None
    if start.startswith(_ZSTD):
        return _unpacked(path, unpack)
    if start == _SQLITE and path.suffix != ".db3":
        raise BagError(f"{path}: is a sqlite3 file; name it .db3")
    if path.suffix == ".db3":
        from formation_gnc.recording.sqlite_file import SqliteFile  # its database takes half a second to import

        return SqliteFile(path, unpack)
    return McapFile(path, unpack)


def _unpacked(path: Path, unpack: Callable[[bytes], bytes] | None) -> StoredFile:
    """Open a file that is compressed as a whole, from a copy that lasts as long as what is returned."""
    directory = tempfile.TemporaryDirectory(prefix="formation_gnc-")
    copy = Path(directory.name) / path.name.removesuffix(COMPRESSED)
    try:
        with path.open("rb") as source, copy.open("wb") as target:
            left = UNPACKED * path.stat().st_size + LARGEST_CHUNK
            for part in zstandard.ZstdDecompressor().read_to_iter(source):
                left -= target.write(part)
                if left < 0:
                    raise BagError(f"{path}: unpacks to more than {UNPACKED} times its size")
    except zstandard.ZstdError as error:
        raise BagError(f"{path}: cannot be decompressed ({error})") from None
    except OSError as error:
        raise BagError(f"{path}: cannot be unpacked to {directory.name}: {error.strerror}") from None
    file = _open(copy, unpack)
    file.copy = directory
    return file


def _is_bounded(data: bytes) -> bool:
    return zstandard.frame_content_size(data) <= LARGEST_CHUNK


def _decompressed(data: bytes) -> bytes:
    """A message of a bag that compresses each; as it is where it is plain after all, empty where it is damaged."""
    if not data.startswith(_ZSTD):
        return data
    try:
        return zstandard.ZstdDecompressor().decompressobj().decompress(data) if _is_bounded(data) else b""
    except zstandard.ZstdError:
        return b""


def _metadata(path: Path) -> dict[str, Any]:
    """Contents of the bag's metadata.yaml; empty where there is none that can be read."""
    try:
        document = load_limited(read_plain(path / "metadata.yaml").decode())
    except (OSError, ValueError, yaml.YAMLError):
        return {}
    information = document.get("rosbag2_bagfile_information") if isinstance(document, dict) else None
    return information if isinstance(information, dict) else {}
