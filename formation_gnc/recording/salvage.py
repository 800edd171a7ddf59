"""Readable records of an MCAP file that was cut or damaged anywhere."""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import SEEK_END, BytesIO
from typing import Any, BinaryIO

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    Schema,
)
from numpy.typing import NDArray

from formation_gnc.recording.mcap_file import LARGEST_CHUNK, MAGIC, UNREADABLE, chunk_content, chunk_records

_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")  # first and last stamp, size, checksum, length of the compression's name
_COMPRESSIONS = (b"\x04\0\0\0zstd", b"\x03\0\0\0lz4")  # as they stand in a chunk
_HEAD = _RECORD.size + _CHUNK.size + 8  # bytes of a plain chunk before its records
_SEARCH_BLOCK = 1 << 20  # bytes searched at a time
_LARGEST_RECORD = 1 << 30  # bytes; a longer one is a damaged length
_BLOCK = 1 << 9  # bytes of a damaged chunk decompressed at a time
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.MESSAGE_INDEX: MessageIndex.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.METADATA: Metadata.read,
    Opcode.DATA_END: DataEnd.read,
}


@dataclass
class Group:
    """Messages and definitions of one chunk, or a single one outside chunks."""

    records: list[Message | Schema | Channel]
    damaged: bool = False


class SalvageReader:
    """Reads the records of a file in order, and skips what is damaged.

    Attributes:
        reasons: what is damaged, one line each; complete once all records were read.
        has_wrong_lengths: whether a chunk was read whose length is wrong, which other readers cannot.
    """

    def __init__(self, stream: BinaryIO) -> None:
        """Read an open file; `stream.name` is its name in `reasons`."""
        self.reasons: list[str] = []
        self.has_wrong_lengths = False
        self._stream = stream
        self._size = stream.seek(0, SEEK_END)

    def records(self) -> Iterator[McapRecord | Group]:
        """Records in file order, those of a chunk, or a message or definition outside chunks, as a group."""
        self._stream.seek(0)
        offset = len(MAGIC)
        if self._stream.read(offset) != MAGIC:
            self._note("does not begin as an MCAP file")
        closed = False
        while offset < self._size:
            record, end = self._record_at(offset)
            if record is None and not closed:
                offset = self._next_chunk(offset)
                if offset == self._size:
                    break
                record, end = self._chunk_at(offset)
            if record is None:
                return  # only the index is damaged: no messages follow the end of the data
            if isinstance(record, DataEnd):
                closed = True
                self._verify(record, offset)
            yield self._grouped(record, offset)
            offset = end
        if not closed:
            self._note("was not closed, what came last may be missing")

    def _note(self, reason: str) -> None:
        self.reasons.append(f"{self._stream.name}: {reason}")

    def _grouped(self, record: McapRecord, offset: int) -> McapRecord | Group:
        if isinstance(record, Chunk):
            return self._unpacked(record, offset)
        if isinstance(record, (Message, Schema, Channel)):
            return Group([record])
        return record

    def _verify(self, end: DataEnd, offset: int) -> None:
        """Note a wrong checksum that no other damage explains."""
        if end.data_section_crc and end.data_section_crc != self._checksum(offset) and not self.reasons:
            self._note("checksum wrong outside the chunks, in metadata or message index")

    def _checksum(self, size: int) -> int:
        self._stream.seek(0)
        checksum = 0
        while self._stream.tell() < size:
            checksum = zlib.crc32(self._stream.read(min(_SEARCH_BLOCK, size - self._stream.tell())), checksum)
        return checksum

    def _record_at(self, offset: int) -> tuple[McapRecord | None, int]:
        """Record at an offset, None when it is not whole and plausible, and the offset behind it."""
        self._stream.seek(offset)
        header = self._stream.read(_RECORD.size)
        if len(header) < _RECORD.size:
            return None, self._size
        opcode, length = _RECORD.unpack(header)
        end = offset + _RECORD.size + length
        if end > self._size or length > _LARGEST_RECORD:
            return None, self._size
        return _parsed(opcode, self._stream.read(length)), end

    def _next_chunk(self, offset: int) -> int:
        """Offset of the first chunk from `offset` on, noting what is skipped; the file's size for none."""
        found = self._find_chunk(offset)
        if found == offset:
            self.has_wrong_lengths = True
        else:
            self._note(f"bytes {offset} to {found} cannot be read")
        return found

    def _find_chunk(self, offset: int) -> int:
        """Offset of the first chunk from `offset` on; the file's size for none."""
        for start in range(offset, self._size, _SEARCH_BLOCK):
            self._stream.seek(start)
            found = first_chunk(self._stream.read(_SEARCH_BLOCK + _HEAD))
            if found is not None:
                return start + found
        return self._size

    def _chunk_at(self, offset: int) -> tuple[Chunk, int]:
        """Chunk at an offset that `_find_chunk` gave, and the offset of the next record.

        Its opcode or a length may be wrong, or the file cut inside it.
        """
        stream = self._stream
        stream.seek(offset)
        _, length = _RECORD.unpack(stream.read(_RECORD.size))
        start, end, uncompressed_size, checksum, name_length = _CHUNK.unpack(stream.read(_CHUNK.size))
        compression = stream.read(name_length).decode(errors="replace")
        data_length = int.from_bytes(stream.read(8), "little")
        data_at = stream.tell()
        ends = [data_at + data_length, offset + _RECORD.size + length]
        if not compression:
            ends.append(data_at + uncompressed_size)
        for stop in ends:
            if data_at <= stop <= self._size and (stop == self._size or self._record_at(stop)[0] is not None):
                break
        else:
            stop = self._find_chunk(data_at)
        stream.seek(data_at)
        chunk = Chunk(compression, stream.read(stop - data_at), end, start, checksum, uncompressed_size)
        return chunk, max(stop, data_at)

    def _unpacked(self, chunk: Chunk, offset: int) -> Group:
        """Records of a chunk; of a damaged one those that are readable, unverified."""
        try:
            return Group(list(chunk_records(chunk_content(chunk))))
        except UNREADABLE as error:
            reason = f"chunk at byte {offset}: {error or type(error).__name__}"
        group = Group([], damaged=True)
        try:
            for record in chunk_records(_decompressed(chunk)):
                if not isinstance(record, Message) or (
                    chunk.message_start_time <= record.log_time <= chunk.message_end_time
                ):
                    group.records.append(record)
        except UNREADABLE:
            pass  # the readable part ends here
        count = sum(isinstance(record, Message) for record in group.records)
        self._note(f"{reason}; {count} messages saved from it, unverified")
        return group


def _parsed(opcode: int, body: bytes) -> McapRecord | None:
    """Record of a body; None when it does not fit its opcode."""
    fields = ReadDataStream(BytesIO(body))
    try:
        if opcode == Opcode.MESSAGE:
            message: Message = Message.read(fields, len(body))
            return message
        if opcode not in _READERS:
            return McapRecord() if opcode in Opcode else None
        record: McapRecord = _READERS[opcode](fields)
    except UNREADABLE:
        return None
    if fields.count != len(body):
        return None
    if isinstance(record, Attachment) and zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        return None
    return record


def _decompressed(chunk: Chunk) -> bytes:
    """Content of a damaged chunk up to the damage."""
    if not chunk.compression:
        return chunk.data
    if chunk.compression == "zstd":
        decompress = zstandard.ZstdDecompressor().decompressobj().decompress
    elif chunk.compression == "lz4":
        decompress = lz4.frame.LZ4FrameDecompressor().decompress
    else:
        return b""
    content = bytearray()
    try:
        for start in range(0, len(chunk.data), _BLOCK):
            if len(content) > LARGEST_CHUNK:
                return b""  # no chunk of a recorder's
            content += decompress(chunk.data[start : start + _BLOCK])
    except (zstandard.ZstdError, RuntimeError, EOFError):
        pass  # the readable part ends here
    return bytes(content)


def first_chunk(block: bytes) -> int | None:
    """Offset of the first chunk that begins in a block, by what its header repeats; None for none.

    A compressed one is known by its compression's name. One of no compression has its length thrice: in the
    record, as size of its content, and before its content; two that agree are enough where the opcode stands.
    """
    name_at = _RECORD.size + _CHUNK.size - 4
    hits = [block.find(name, name_at) - name_at for name in _COMPRESSIONS]
    plain = _first_plain_chunk(block)
    return min((hit for hit in (*hits, -1 if plain is None else plain) if hit >= 0), default=None)


def _first_plain_chunk(block: bytes) -> int | None:
    count = len(block) - _HEAD + 1
    if count < 1:
        return None

    def field(offset: int, kind: str) -> NDArray[Any]:
        """A field of the chunks that might begin at each byte."""
        return np.ndarray((count,), kind, block, offset, (1,))

    length, size, content = field(1, "<u8"), field(25, "<u8"), field(41, "<u8")
    inner = np.uint64(_HEAD - _RECORD.size)
    agreeing = (size == content).astype(np.int8) + (length == size + inner) + (length == content + inner)
    plausible = (
        (field(37, "<u4") == 0)
        & (field(9, "<u8") <= field(17, "<u8"))
        & (np.maximum(size, content) > 0)
        & (agreeing >= np.where(field(0, "u1") == int(Opcode.CHUNK), 1, 3))
    )
    for found in np.flatnonzero(plausible).tolist():
        first = block[found + _HEAD : found + _HEAD + 1]
        if not first or first[0] in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            return int(found)
    return None
