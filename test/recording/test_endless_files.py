"""What could be read for ever, or unpacks to more than there is, is refused at once by whatever reads it."""

import os
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.records import Chunk

from formation_gnc.cli import main
from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.plain_file import LARGEST, read_plain
from formation_gnc.recording import Bag
from formation_gnc.recording.files import UNPACKED
from formation_gnc.recording.mcap_file import LARGEST_CHUNK, MAGIC, chunk_content
from formation_gnc.recording.recover import recover

ENDLESS = {
    "a named pipe": os.mkfifo,
    "a device": lambda path: path.symlink_to("/dev/zero"),
}
ZEROS = bytes(1 << 20)


@pytest.fixture(params=ENDLESS.values(), ids=ENDLESS.keys())
def endless(request: pytest.FixtureRequest) -> Callable[[Path], object]:
    make: Callable[[Path], object] = request.param
    return make


@pytest.mark.timeout(60)
@pytest.mark.parametrize("name", ["bag.mcap", "bag.db3", "bag.mcap.zstd"])
def test_an_endless_file_is_no_bag(endless: Callable[[Path], object], name: str, tmp_path: Path) -> None:
    endless(tmp_path / name)
    for path in (tmp_path, tmp_path / name):
        with pytest.raises(BagError, match="Is no regular file"):
            Bag(path)
        with pytest.raises(BagError, match="Is no regular file"):
            recover(path, None)


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    "command",
    [["check", "FILE"], ["sil", "FILE", "--in-process"], ["campaign", "FILE"], ["new", "own", "--from", "FILE"]],
)
@pytest.mark.parametrize("suffix", [".yaml", ".tle"])
def test_an_endless_parameter_file_is_refused_in_a_line(
    endless: Callable[[Path], object],
    command: list[str],
    suffix: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / f"endless{suffix}"
    endless(file)
    assert main([str(file) if word == "FILE" else word for word in command]) in (1, 2)
    (line,) = capsys.readouterr().err.splitlines()
    assert "endless" in line


@pytest.mark.timeout(60)
def test_an_endless_metadata_file_is_as_none(endless: Callable[[Path], object], tmp_path: Path) -> None:
    (tmp_path / "bag.mcap").write_bytes(b"")
    endless(tmp_path / "metadata.yaml")
    with pytest.raises(BagError, match="is not an MCAP file"):
        Bag(tmp_path)


def test_a_database_of_an_endless_view_is_no_bag(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "bag.db3")) as database:
        database.executescript(
            "CREATE TABLE topics(id INTEGER); CREATE VIEW messages AS WITH RECURSIVE n(i) AS"
            " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS id, 1 AS topic_id, i AS timestamp FROM n"
        )
    for read in (Bag, lambda path: recover(path, None)):
        with pytest.raises(BagError, match="has views"):
            read(tmp_path)


def test_a_large_file_is_not_read_as_a_whole(tmp_path: Path) -> None:
    file = tmp_path / "large"
    file.write_bytes(bytes(LARGEST))
    assert len(read_plain(file)) == LARGEST
    with file.open("ab") as stream:
        stream.write(b"\0")
    with pytest.raises(OSError, match="Is larger than 16 MB"):
        read_plain(file)


def zstd(size: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()  # it does not say to how much it unpacks
    return b"".join([*(packer.compress(ZEROS) for _ in range(size // len(ZEROS))), packer.flush()])


def told_zstd(size: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj(size=size)
    return b"".join([*(packer.compress(ZEROS) for _ in range(size // len(ZEROS))), packer.flush()])


def packed_lz4(size: int) -> bytes:
    with lz4.frame.LZ4FrameCompressor() as packer:
        return b"".join([packer.begin(), *(packer.compress(ZEROS) for _ in range(size // len(ZEROS))), packer.flush()])


@pytest.mark.parametrize(
    ("compression", "pack"), [("zstd", zstd), ("zstd", told_zstd), ("lz4", packed_lz4)], ids=["zstd", "told", "lz4"]
)
@pytest.mark.parametrize("claim", [0, 1000, 2**60])
def test_a_chunk_that_unpacks_to_too_much_is_damaged(
    compression: str, pack: Callable[[int], bytes], claim: int, tmp_path: Path
) -> None:
    data = pack(LARGEST_CHUNK + 2 * len(ZEROS))
    with pytest.raises((ValueError, zstandard.ZstdError)):
        chunk_content(Chunk(compression, data, 0, 0, 0, claim))
    body = struct.pack("<QQQI", 0, 1, claim, 0) + struct.pack("<I", len(compression)) + compression.encode()
    body += struct.pack("<Q", len(data)) + data
    (tmp_path / "bag.mcap").write_bytes(MAGIC + struct.pack("<BQ", 6, len(body)) + body)
    assert "damaged" in (Bag(tmp_path).damage or "")
    assert recover(tmp_path, None).saved == 0


def test_a_chunk_within_the_limit_is_unpacked() -> None:
    for compression, pack in (("zstd", told_zstd), ("lz4", packed_lz4)):
        size = 4 * len(ZEROS)
        assert chunk_content(Chunk(compression, pack(size), 0, 0, 0, size)) == bytes(size)


def test_a_file_that_unpacks_to_hundreds_of_times_its_size_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bag.mcap.zstd"
    file.write_bytes(zstd(2 * LARGEST_CHUNK))
    with pytest.raises(ConfigurationError, match=f"unpacks to more than {UNPACKED} times its size"):
        Bag(file)
