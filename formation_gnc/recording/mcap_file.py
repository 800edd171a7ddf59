"""Reader of one MCAP file by its data section: what its summary leaves out or has wrong does not matter."""

import struct
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator
from io import SEEK_END, BytesIO
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.summary import Summary

from formation_gnc.errors import BagError
from formation_gnc.recording.stored_file import Span, StoredFile

MAGIC = b"\x89MCAP0\r\n"
UNREADABLE = (
    McapError,
    struct.error,
    ValueError,
    EOFError,
    MemoryError,
    RuntimeError,
    OverflowError,
    zstandard.ZstdError,
)
"""Exceptions of the MCAP and compression libraries on damaged bytes."""

LARGEST_CHUNK = 1 << 28
"""Most bytes that a chunk may unpack to: hundreds of times those that writers make."""

LZ4_RATIO = 255
"""Most that LZ4 unpacks a byte to."""

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER = struct.Struct("<BQQQI")
_CHECKSUM = struct.Struct("<I")
_BLOCK = 1 << 20  # bytes read at once
_PRIVATE = 0x80  # first opcode of others' records

FileRecord = Message | Schema | Channel | Chunk | Metadata | Attachment


class DamagedRecordError(McapError):
    """A record that is cut or damaged, at an offset in the file."""

    def __init__(self, offset: int, reason: Exception) -> None:
        """Name the reason, or its kind where it has no words."""
        super().__init__(str(reason) or type(reason).__name__)
        self.offset = offset


class McapFile(StoredFile):
    """One MCAP file.

    Raises:
        BagError: the file cannot be opened, is no MCAP file, or was finished and is damaged.
    """

    def __init__(self, path: Path, unpack: Callable[[bytes], bytes] | None = None) -> None:
        """Scan the file."""
        super().__init__(path, unpack)
        self._schemas: dict[int, Schema] = {}
        with self._open() as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise BagError(f"{path}: is not an MCAP file")
            self._scan(stream)

    def _open(self) -> BinaryIO:
        try:
            return self.path.open("rb")
        except OSError as error:
            raise BagError(f"{self.path}: cannot be read: {error.strerror}") from None

    def _scan(self, stream: BinaryIO) -> None:
        outside = Span(None)
        is_finished = _is_finished(stream)
        try:
            for offset, record in file_records(stream):
                if isinstance(record, Chunk):
                    records = _unpacked(record, offset)
                    span = self._begin_span(offset)
                    for inner in records:
                        self._add(inner, span)
                else:
                    self._add(record, outside)
        except DamagedRecordError as error:
            if is_finished:
                raise self._damaged(error.offset, f"({error})") from None
            self.damage = f"{self.path}: cut or damaged at byte {error.offset} ({error})"
        if not is_finished and self.damage is None:
            self.damage = f"{self.path}: cut: it was not closed, what came last may be missing"
        if is_finished and not data_section_is_intact(stream):
            raise BagError(f"{self.path}: damaged (the checksum of its data section is wrong); recover it first")
        if outside.start <= outside.end:
            ends = [*self.spans, outside]
            held = set().union(*(span.series for span in ends))
            self.spans = [Span(None, min(span.start for span in ends), max(span.end for span in ends), series=held)]

    def _add(self, record: FileRecord, span: Span) -> None:
        match record:
            case Message():
                self._note(span, record.channel_id, record.data, record.log_time)
            case Schema():
                self._schemas.setdefault(record.id, record)
            case Channel():
                self._define(self._schemas.get(record.schema_id), record)
            case Metadata():
                self.metadata[record.name] = record.metadata
            case Attachment():
                self.attachments[record.name] = record.data

    def _span_records(self, span: Span, channels: Collection[int]) -> Iterable[tuple[int, bytes, int]]:
        if span.offset is None:
            return self._all_records(channels)
        with self._open() as stream:
            stream.seek(span.offset + _RECORD.size)
            try:
                found = chunk_messages(chunk_content(Chunk.read(ReadDataStream(stream))), channels)
            except UNREADABLE as error:
                raise self._damaged(span.offset, f"({error})") from None
        if self._unpack is bytes:  # as they are
            return found
        return [(channel, self._unpack(data), sequence) for channel, data, sequence in found]

    def _all_records(self, channels: Collection[int]) -> Iterator[tuple[int, bytes, int]]:
        with self._open() as stream:
            stream.seek(len(MAGIC))
            try:
                for offset, record in file_records(stream):
                    for each in _unpacked(record, offset) if isinstance(record, Chunk) else (record,):
                        if isinstance(each, Message) and each.channel_id in channels:
                            yield each.channel_id, self._unpack(each.data), each.sequence
            except UNREADABLE as error:
                if self.damage is None:
                    raise self._damaged(None, f"({error})") from None

    def _damaged(self, offset: int | None, reason: str) -> BagError:
        return BagError(f"{self.path}: damaged in the chunk at byte {offset} {reason}; recover it first")


def file_records(stream: BinaryIO) -> Iterator[tuple[int, FileRecord]]:
    """Records of a file with their offsets, from where the stream stands; chunks as they are.

    The definitions that a summary repeats come too: of a topic without messages they may be all there is.

    Raises DamagedRecordError at a truncated or damaged record before the summary.
    """
    offset = stream.tell()
    size = stream.seek(0, SEEK_END)
    in_summary = False
    while offset < size:
        try:
            opcode, record, end = _file_record(stream, offset, size)
        except UNREADABLE as error:
            if in_summary:
                return
            raise DamagedRecordError(offset, error) from None
        if opcode == Opcode.FOOTER:
            return
        in_summary = in_summary or opcode == Opcode.DATA_END
        if record is not None:
            yield offset, record
        offset = end


def _file_record(stream: BinaryIO, offset: int, size: int) -> tuple[int, FileRecord | None, int]:
    """Opcode, record (None for one that is passed over) and end of what begins at an offset of a file."""
    readers: dict[int, Callable[[ReadDataStream], FileRecord]] = {
        Opcode.SCHEMA: Schema.read,
        Opcode.CHANNEL: Channel.read,
        Opcode.CHUNK: Chunk.read,
        Opcode.METADATA: Metadata.read,
        Opcode.ATTACHMENT: Attachment.read,
    }
    stream.seek(offset)
    opcode, length = _RECORD.unpack(stream.read(_RECORD.size))
    end = offset + _RECORD.size + length
    if end > size:
        raise EOFError("the file ends within a record")
    if opcode == Opcode.MESSAGE:
        return opcode, next(chunk_records(_RECORD.pack(opcode, length) + stream.read(length))), end
    if opcode in readers:
        return opcode, readers[opcode](ReadDataStream(BytesIO(stream.read(length)))), end
    if opcode < _PRIVATE and opcode not in list(Opcode):
        raise ValueError(f"record of unknown kind {opcode}")
    return opcode, None, end


def _unpacked(chunk: Chunk, offset: int) -> list[Message | Schema | Channel]:
    """All records of a chunk at an offset of a file; raises DamagedRecordError."""
    try:
        return list(chunk_records(chunk_content(chunk)))
    except UNREADABLE as error:
        raise DamagedRecordError(offset, error) from None


def _is_finished(stream: BinaryIO) -> bool:
    """Whether a file ends as a closed one does; leaves the stream behind the first magic bytes."""
    size = stream.seek(0, SEEK_END)
    stream.seek(max(0, size - len(MAGIC) - _FOOTER.size))
    end = stream.read()
    stream.seek(len(MAGIC))
    return end[:1] == bytes([Opcode.FOOTER]) and end[-len(MAGIC) :] == MAGIC


def data_section_is_intact(stream: BinaryIO) -> bool:
    """Whether the checksum of all that stands before a file's summary holds; True where the file has none.

    It alone covers metadata, such as recorded parameters, and definitions outside chunks.
    """
    size, offset = stream.seek(0, SEEK_END), len(MAGIC)
    stream.seek(0)
    if stream.read(len(MAGIC)) != MAGIC:
        return True
    while offset + _RECORD.size <= size:
        stream.seek(offset)
        opcode, length = _RECORD.unpack(stream.read(_RECORD.size))
        if opcode == Opcode.DATA_END:
            (expected,) = _CHECKSUM.unpack(stream.read(_CHECKSUM.size))
            return not expected or _checksum(stream, offset) == expected
        offset += _RECORD.size + length
    return True


def _checksum(stream: BinaryIO, size: int) -> int:
    """CRC-32 of a file's first bytes."""
    stream.seek(0)
    checksum = 0
    while size:
        block = stream.read(min(size, _BLOCK))
        checksum, size = zlib.crc32(block, checksum), size - len(block)
    return checksum


def verified_summary(stream: BinaryIO) -> Summary | None:
    """Summary of a finished file whose checksum holds and which indexes every message, else None."""
    stream.seek(0, SEEK_END)
    size = stream.tell()
    if size < 2 * len(MAGIC) + _FOOTER.size:
        return None
    stream.seek(size - len(MAGIC) - _FOOTER.size)
    footer = stream.read(_FOOTER.size)
    opcode, length, start, _, checksum = _FOOTER.unpack(footer)
    if opcode != Opcode.FOOTER or length != 20 or not 0 < start < size or stream.read() != MAGIC:
        return None
    stream.seek(start)
    covered = stream.read(size - len(MAGIC) - 4 - start)
    if checksum and zlib.crc32(covered) != checksum:
        return None
    stream.seek(0)
    try:
        summary = make_reader(stream).get_summary()
    except UNREADABLE:
        return None
    if summary is None or summary.statistics is None:
        return None
    return summary if summary.chunk_indexes or not summary.statistics.message_count else None


def chunk_content(chunk: Chunk) -> bytes:
    """Decompressed records of a chunk after its checksum is verified; raises one of UNREADABLE, for a huge one too."""
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":
        size = max(size, zstandard.frame_content_size(chunk.data))
    elif chunk.compression == "lz4":
        size = max(size, lz4.frame.get_frame_info(chunk.data)["content_size"] or LZ4_RATIO * len(chunk.data))
    if size > LARGEST_CHUNK:
        raise ValueError(f"chunk of {size} bytes, must be at most {LARGEST_CHUNK}")
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(length)


def chunk_records(content: bytes) -> Iterator[Message | Schema | Channel]:
    """Records of a decompressed chunk, in order; raises one of UNREADABLE at a truncated record.

    Unlike mcap's `breakup_chunk` it holds one record at a time, detects a truncated one, and takes a third of
    the time.
    """
    offset, end = 0, len(content)
    while offset < end:
        opcode, length = _RECORD.unpack_from(content, offset)
        body, offset = offset + _RECORD.size, offset + _RECORD.size + length
        if offset > end:
            raise EndOfFile
        if opcode == Opcode.MESSAGE:
            channel, sequence, stamp, publish_time = _MESSAGE.unpack_from(content, body)
            yield Message(channel, stamp, content[body + _MESSAGE.size : offset], publish_time, sequence)
        elif opcode == Opcode.SCHEMA:
            yield Schema.read(ReadDataStream(BytesIO(content[body:offset])))
        elif opcode == Opcode.CHANNEL:
            yield Channel.read(ReadDataStream(BytesIO(content[body:offset])))
        elif not opcode:
            raise ValueError("record of unknown kind 0")


def chunk_messages(content: bytes, channels: Collection[int]) -> list[tuple[int, bytes, int]]:
    """Channel, data and sequence number of some channels' messages in a decompressed chunk, in order.

    Raises one of UNREADABLE at a truncated record.
    """
    found, offset, end, message = [], 0, len(content), int(Opcode.MESSAGE)
    record, start, data = _RECORD.unpack_from, _MESSAGE.unpack_from, _RECORD.size + _MESSAGE.size
    while offset < end:
        opcode, length = record(content, offset)
        following = offset + _RECORD.size + length
        if following > end:
            raise EndOfFile
        if opcode == message:
            channel, sequence, _, _ = start(content, offset + _RECORD.size)
            if channel in channels:
                found.append((channel, content[offset + data : following], sequence))
        offset = following
    return found


def file_number(stem: str) -> int:
    """Number at the end of a file's name; -1 for none."""
    digits = stem.rpartition("_")[2]
    return int(digits) if digits.isdecimal() else -1
