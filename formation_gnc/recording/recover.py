"""Saving what can be saved of a bag that was cut or damaged."""

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import SEEK_END, BytesIO
from pathlib import Path
from typing import BinaryIO

import yaml
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

from formation_gnc.recording.mcap_file import (
    MAGIC,
    UNREADABLE,
    chunk_content,
    chunk_records,
    mcap_files,
    verified_summary,
)
from formation_gnc.recording.writer import BagWriter, TopicDefinition

WHOLE, NOTHING_SAVED, PARTLY_LOST = 0, 1, 3

_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")  # first and last stamp, size, checksum, length of the compression's name
_COMPRESSIONS = (b"\x04\0\0\0zstd", b"\x03\0\0\0lz4")  # as they stand in a chunk
_SEARCHED = 1 << 20  # bytes looked through at a time for the next chunk
_LARGEST_RECORD = 1 << 30  # bytes; a longer one is a damaged length
_ZSTD_PIECE = 1 << 9  # compressed bytes of a broken chunk tried at a time
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


@dataclass(frozen=True)
class Recovery:
    """What came of a recovery.

    status: WHOLE, PARTLY_LOST or NOTHING_SAVED, as the command's exit status. output: the new bag, None where
    none was needed or possible. saved: messages in it, or in the old bag when that is whole. lost: messages
    known to be lost, by topic. reasons: what is damaged, one line each.
    """

    status: int
    output: Path | None
    saved: int
    lost: dict[str, int]
    reasons: tuple[str, ...]


def recover(path: Path, output: Path) -> Recovery:
    """Write everything that can be read of a bag into a new bag with an index.

    A bag that is whole is left alone, unless its index is missing. Messages of a chunk whose checksum is
    wrong are saved as far as the chunk can be taken apart; `reasons` says where these stand. The new bag's
    metadata record "recovery" repeats what was lost.

    path: bag directory or .mcap file. output: directory of the new bag, which must not exist.
    Raises ConfigurationError when the bag does not exist or the output does.
    """
    surveys = [_survey(file) for file in mcap_files(path)]
    reasons = tuple(reason for survey in surveys for reason in survey.reasons) + _missing_files(path)
    saved = sum(survey.saved.total() for survey in surveys)
    lost: Counter[str] = Counter()
    for survey in surveys:
        lost.update(survey.lost)
    if not saved:
        return Recovery(NOTHING_SAVED, None, 0, dict(lost), reasons or (f"{path}: holds no message",))
    if not reasons and all(survey.indexed for survey in surveys):
        return Recovery(WHOLE, None, saved, {}, ())
    _write(surveys, output, {"source": str(path), "lost": str(dict(lost)), "reasons": "\n".join(reasons)})
    return Recovery(PARTLY_LOST if reasons else WHOLE, output, saved, dict(lost), reasons)


@dataclass
class _Survey:
    """What is left of a file. saved: messages by channel; lost: those known to be missing, by topic."""

    path: Path
    indexed: bool = False
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    saved: Counter[int] = field(default_factory=Counter)
    lost: Counter[str] = field(default_factory=Counter)
    reasons: list[str] = field(default_factory=list)


@dataclass
class _Piece:
    """Messages and definitions that stand together: those of one chunk, or a single one outside chunks."""

    records: list[Message | Schema | Channel]
    damaged: bool = False


def _survey(path: Path) -> _Survey:
    survey = _Survey(path)
    found: Counter[int] = Counter()
    missing: Counter[int] = Counter()
    from_damaged: Counter[int] | None = None  # messages saved of the chunk before, when that is damaged
    with path.open("rb") as stream:
        summary = verified_summary(stream)
        if summary is not None:
            survey.indexed = True
            survey.schemas, survey.channels = summary.schemas, summary.channels
        for record in _walk(stream, survey.reasons):
            match record:
                case _Piece():
                    counts = Counter(item.channel_id for item in record.records if isinstance(item, Message))
                    found.update(counts)
                    from_damaged = counts if record.damaged else None
                    for item in record.records:
                        if isinstance(item, Schema):
                            survey.schemas.setdefault(item.id, item)
                        elif isinstance(item, Channel):
                            survey.channels.setdefault(item.id, item)
                case MessageIndex() if from_damaged is not None:
                    missing[record.channel_id] += len(record.records) - from_damaged[record.channel_id]
                case Metadata():
                    survey.metadata[record.name] = record.metadata
                case Attachment():
                    survey.attachments[record.name] = record.data
    if summary is not None and summary.statistics is not None:
        missing = Counter(summary.statistics.channel_message_counts) - found
    for channel_id, count in (+missing).items():
        channel = survey.channels.get(channel_id)
        survey.lost[channel.topic if channel else f"channel {channel_id}"] += count
    for channel_id, count in found.items():
        channel = survey.channels.get(channel_id)
        if channel is not None and channel.schema_id in survey.schemas:
            survey.saved[channel_id] = count
        else:
            survey.lost[f"channel {channel_id}"] += count
            survey.reasons.append(f"{path}: the definition of channel {channel_id} is lost")
    return survey


def _write(surveys: list[_Survey], output: Path, report: dict[str, str]) -> None:
    """Write what the surveys found into a new bag."""
    metadata = {name: values for survey in surveys for name, values in survey.metadata.items()}
    metadata.pop("rosbag2", None)
    attachments = {name: data for survey in surveys for name, data in survey.attachments.items()}
    with BagWriter(output, metadata | {"recovery": report}, attachments) as writer:
        added: set[str] = set()
        for survey in surveys:
            for channel in survey.channels.values():
                schema = survey.schemas.get(channel.schema_id)
                if schema is not None and channel.topic not in added:
                    added.add(channel.topic)
                    writer.add_defined_topic(channel.topic, _definition(schema, channel))
            with survey.path.open("rb") as stream:
                for record in _walk(stream, []):
                    for item in record.records if isinstance(record, _Piece) else ():
                        if isinstance(item, Message) and item.channel_id in survey.saved:
                            topic = survey.channels[item.channel_id].topic
                            writer.write(topic, item.data, item.log_time, item.sequence)


def _definition(schema: Schema, channel: Channel) -> TopicDefinition:
    metadata = dict(channel.metadata)
    try:
        yaml.safe_load(metadata.get("offered_qos_profiles", ""))
    except yaml.YAMLError:
        del metadata["offered_qos_profiles"]
    return TopicDefinition(schema.name, schema.data, schema.encoding, channel.message_encoding, metadata)


def _missing_files(path: Path) -> tuple[str, ...]:
    """Files that the bag's metadata.yaml lists and the directory lacks."""
    try:
        listed = yaml.safe_load((path / "metadata.yaml").read_text(encoding="utf-8"))
        names = [str(name) for name in listed["rosbag2_bagfile_information"]["relative_file_paths"]]
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError):
        return ()
    return tuple(f"{path / name}: is missing" for name in names if not (path / name).exists())


def _walk(stream: BinaryIO, reasons: list[str]) -> Iterator[McapRecord | _Piece]:
    """Readable records of a file in their order, chunks taken apart; what is not goes to `reasons`."""
    size = stream.seek(0, SEEK_END)
    stream.seek(0)
    offset = len(MAGIC)
    if stream.read(offset) != MAGIC:
        reasons.append(f"{stream.name}: does not begin as an MCAP file")
    closed = False
    while offset < size:
        record, end = _record_at(stream, offset, size)
        if record is None and not closed:
            chunk_offset = _find_chunk(stream, offset, size)
            if chunk_offset != offset:
                reasons.append(f"{stream.name}: bytes {offset} to {chunk_offset} cannot be read")
            if chunk_offset == size:
                break
            record, end = _chunk_at(stream, chunk_offset, size)
            offset = chunk_offset
        if record is None:
            return  # beyond the end of the data only the index is damaged
        if isinstance(record, Chunk):
            yield _taken_apart(record, f"{stream.name}: chunk at byte {offset}", reasons)
        elif isinstance(record, (Message, Schema, Channel)):
            yield _Piece([record])
        else:
            yield record
        if isinstance(record, DataEnd):
            closed = True
            if record.data_section_crc and record.data_section_crc != _checksum(stream, offset) and not reasons:
                reasons.append(f"{stream.name}: checksum wrong outside the chunks, in metadata or message index")
        offset = end
    if not closed:
        reasons.append(f"{stream.name}: was not closed, what came last may be missing")


def _record_at(stream: BinaryIO, offset: int, size: int) -> tuple[McapRecord | None, int]:
    """The record that begins at the offset, and where it ends; None when it is not whole and plausible."""
    stream.seek(offset)
    header = stream.read(_RECORD.size)
    if len(header) < _RECORD.size:
        return None, size
    opcode, length = _RECORD.unpack(header)
    end = offset + _RECORD.size + length
    if end > size or length > _LARGEST_RECORD:
        return None, size
    body = stream.read(length)
    fields = ReadDataStream(BytesIO(body))
    try:
        if opcode == Opcode.MESSAGE:
            return Message.read(fields, length), end
        if opcode not in _READERS:
            return (McapRecord(), end) if opcode in Opcode and opcode != Opcode.MESSAGE else (None, end)
        record = _READERS[opcode](fields)
    except UNREADABLE:
        return None, end
    if fields.count != length:
        return None, end
    if isinstance(record, Attachment) and zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        return None, end
    return record, end


def _find_chunk(stream: BinaryIO, offset: int, size: int) -> int:
    """Offset of the first chunk that begins there or later, known by its compression's name; size if none."""
    name_at = _RECORD.size + _CHUNK.size - 4
    start = offset + name_at
    while start < size:
        stream.seek(start)
        block = stream.read(_SEARCHED + 8)
        hits = [block.find(name) for name in _COMPRESSIONS]
        found = min((hit for hit in hits if hit >= 0), default=-1)
        if found >= 0:
            return start + found - name_at
        start += _SEARCHED
    return size


def _chunk_at(stream: BinaryIO, offset: int, size: int) -> tuple[Chunk, int]:
    """The chunk at an offset that `_find_chunk` gave, and where the next record begins.

    Its opcode or a length may be wrong, or the file cut inside it.
    """
    stream.seek(offset)
    _, length = _RECORD.unpack(stream.read(_RECORD.size))
    start, end, uncompressed_size, checksum, name_length = _CHUNK.unpack(stream.read(_CHUNK.size))
    compression = stream.read(name_length).decode()
    data_length = int.from_bytes(stream.read(8), "little")
    data_at = stream.tell()
    for stop in (data_at + data_length, offset + _RECORD.size + length):
        if data_at <= stop <= size and (stop == size or _record_at(stream, stop, size)[0] is not None):
            break
    else:
        stop = _find_chunk(stream, data_at, size)
    stream.seek(data_at)
    chunk = Chunk(compression, stream.read(stop - data_at), end, start, checksum, uncompressed_size)
    return chunk, max(stop, data_at)


def _taken_apart(chunk: Chunk, place: str, reasons: list[str]) -> _Piece:
    """Records of a chunk; of a damaged one those that can be made out, which nothing verifies."""
    try:
        return _Piece(list(chunk_records(chunk_content(chunk))))
    except UNREADABLE as error:
        reason = f"{place}: {error or type(error).__name__}"
    piece = _Piece([], damaged=True)
    try:
        for record in chunk_records(_decompressed(chunk)):
            if not isinstance(record, Message) or (
                chunk.message_start_time <= record.log_time <= chunk.message_end_time
            ):
                piece.records.append(record)
    except UNREADABLE:
        pass  # here the readable part ends
    count = sum(isinstance(record, Message) for record in piece.records)
    reasons.append(f"{reason}; {count} messages saved from it, unverified")
    return piece


def _decompressed(chunk: Chunk) -> bytes:
    """Content of a damaged chunk up to the damage."""
    if chunk.compression != "zstd":
        return chunk.data if not chunk.compression else b""
    content = b""
    decompressor = zstandard.ZstdDecompressor().decompressobj()
    try:
        for start in range(0, len(chunk.data), _ZSTD_PIECE):
            content += decompressor.decompress(chunk.data[start : start + _ZSTD_PIECE])
    except zstandard.ZstdError:
        pass
    return content


def _checksum(stream: BinaryIO, size: int) -> int:
    stream.seek(0)
    checksum = 0
    while stream.tell() < size:
        checksum = zlib.crc32(stream.read(min(_SEARCHED, size - stream.tell())), checksum)
    return checksum
