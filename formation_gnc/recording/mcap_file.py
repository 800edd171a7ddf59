"""Reader of one MCAP file, chunk by chunk: by its index, or after a scan when it was never finished."""

import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from io import SEEK_END, BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.summary import Summary

from formation_gnc.errors import BagError

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

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER = struct.Struct("<BQQQI")


@dataclass(frozen=True)
class Span:
    """Part of a file that is read at once: a chunk, or a whole file with messages outside chunks."""

    offset: int | None
    """Byte at which the chunk begins; None for the whole file."""
    start: int
    """First stamp, ns."""
    end: int
    """Last stamp, ns."""


class McapFile:
    """Reader of one MCAP file in bounded memory.

    Attributes:
        schemas, channels: records by id.
        counts: number of messages by channel id.
        spans: in file order.
        metadata, attachments: by name, the last of each.
        damage: None for a finished file, else the reason why it ends early; everything before is read.

    Raises:
        BagError: the file cannot be opened or is no MCAP file, or, while reading, a chunk is damaged.
    """

    def __init__(self, path: Path) -> None:
        """Read the index, or scan a file that has none."""
        self.path = path
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: Counter[int] = Counter()
        self.spans: list[Span] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.damage: str | None = None
        with self._open() as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise BagError(f"{path}: is not an MCAP file")
            summary = verified_summary(stream)
            if summary is not None:
                self._read_index(summary, stream)
            else:
                self._scan(stream)

    def messages(
        self, channels: Collection[int] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[Message]:
        """Messages of some channels (None: all) with start_ns <= stamp < end_ns, in file order."""
        for span in self.spans:
            if span.end >= start_ns and span.start < end_ns:
                for message in self.span_messages(span, channels):
                    if start_ns <= message.log_time < end_ns:
                        yield message

    def span_messages(self, span: Span, channels: Collection[int] | None = None) -> Iterator[Message]:
        """Messages of some channels (None: all) in one span, in file order."""
        with self._open() as stream:
            try:
                if span.offset is None:
                    records: Iterator[McapRecord] = StreamReader(stream, validate_crcs=True).records
                else:
                    stream.seek(span.offset + _RECORD.size)
                    records = chunk_records(chunk_content(Chunk.read(ReadDataStream(stream))), channels)
                for record in records:
                    if isinstance(record, Message) and (channels is None or record.channel_id in channels):
                        yield record
            except UNREADABLE as error:
                if self.damage is None or span.offset is not None:
                    raise BagError(
                        f"{self.path}: damaged in the chunk at byte {span.offset} ({error}); recover it first"
                    ) from None

    def _open(self) -> BinaryIO:
        try:
            return self.path.open("rb")
        except OSError as error:
            raise BagError(f"{self.path}: cannot be read: {error.strerror}") from None

    def _read_index(self, summary: Summary, stream: BinaryIO) -> None:
        self.schemas, self.channels = summary.schemas, summary.channels
        assert summary.statistics is not None
        self.counts.update(summary.statistics.channel_message_counts)
        self.spans = [
            Span(index.chunk_start_offset, index.message_start_time, index.message_end_time)
            for index in sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
        ]
        stream.seek(0)
        reader = make_reader(stream)
        try:
            self.metadata = {record.name: record.metadata for record in reader.iter_metadata()}
            self.attachments = {record.name: record.data for record in reader.iter_attachments()}
        except UNREADABLE as error:
            raise BagError(f"{self.path}: metadata or attachments damaged ({error}); recover the bag first") from None

    def _scan(self, stream: BinaryIO) -> None:
        size = stream.seek(0, SEEK_END)
        stream.seek(0)
        offset = 0
        first, last = 2**64, -1  # stamps outside chunks
        try:
            for record in StreamReader(stream, emit_chunks=True, record_size_limit=size).records:
                if isinstance(record, Chunk):
                    for inner in list(chunk_records(chunk_content(record))):  # all or none of a damaged one
                        self._add(inner)
                    self.spans.append(Span(offset, record.message_start_time, record.message_end_time))
                else:
                    self._add(record)
                    if isinstance(record, Message):
                        first, last = min(first, record.log_time), max(last, record.log_time)
                offset = stream.tell()
        except UNREADABLE as error:
            self.damage = f"{self.path}: cut or damaged at byte {offset} ({type(error).__name__}: {error})"
        if last >= 0:
            spans = [*self.spans, Span(None, first, last)]
            self.spans = [Span(None, min(span.start for span in spans), max(span.end for span in spans))]

    def _add(self, record: McapRecord) -> None:
        match record:
            case Message():
                self.counts[record.channel_id] += 1
            case Schema():
                self.schemas[record.id] = record
            case Channel():
                self.channels[record.id] = record
            case Metadata():
                self.metadata[record.name] = record.metadata
            case Attachment():
                self.attachments[record.name] = record.data


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
    """Decompressed records of a chunk after its checksum is verified; raises one of UNREADABLE."""
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(length)


def chunk_records(content: bytes, channels: Collection[int] | None = None) -> Iterator[Message | Schema | Channel]:
    """Records of a decompressed chunk, in order; raises one of UNREADABLE at a truncated record.

    Unlike mcap's `breakup_chunk` it holds one record at a time, detects a truncated one, and takes a third of
    the time.

    Args:
        content: of the chunk.
        channels: of the messages; None for all.
    """
    offset, end = 0, len(content)
    while offset < end:
        opcode, length = _RECORD.unpack_from(content, offset)
        body, offset = offset + _RECORD.size, offset + _RECORD.size + length
        if offset > end:
            raise EndOfFile
        if opcode == Opcode.MESSAGE:
            channel, sequence, stamp, publish_time = _MESSAGE.unpack_from(content, body)
            if channels is None or channel in channels:
                yield Message(channel, stamp, content[body + _MESSAGE.size : offset], publish_time, sequence)
        elif opcode == Opcode.SCHEMA:
            yield Schema.read(ReadDataStream(BytesIO(content[body:offset])))
        elif opcode == Opcode.CHANNEL:
            yield Channel.read(ReadDataStream(BytesIO(content[body:offset])))


def mcap_files(path: Path) -> list[Path]:
    """Files of a bag (a directory or a single file) in order of the number at the end of their names.

    Raises:
        BagError: there is no such bag, or its directory holds no .mcap file.
    """
    if path.is_dir():
        files = sorted(path.glob("*.mcap"), key=lambda file: (_number(file.stem), file.name))
        if not files:
            raise BagError(f"{path}: holds no .mcap file")
        return files
    if not path.exists():
        raise BagError(f"{path}: no such bag")
    return [path]


def _number(stem: str) -> int:
    digits = stem.rpartition("_")[2]
    return int(digits) if digits.isdecimal() else -1
