"""Recovery of bags that were cut or damaged."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.records import Attachment, Channel, Message, MessageIndex, Metadata, Schema
from mcap.summary import Summary

from formation_gnc.errors import BagError
from formation_gnc.recording.files import COMPRESSED, bag_files, missing_files, unpacker
from formation_gnc.recording.mcap_file import data_section_is_intact, verified_summary
from formation_gnc.recording.salvage import Group, SalvageReader
from formation_gnc.recording.sqlite_salvage import SqliteSalvage
from formation_gnc.recording.stored_file import Series, type_of
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.recording.writer import BagWriter

type Unpack = Callable[[bytes], bytes]

WHOLE, NOTHING_SAVED, PARTLY_LOST = 0, 1, 3


@dataclass(frozen=True)
class Recovery:
    """Outcome of a recovery."""

    status: int
    """WHOLE, PARTLY_LOST or NOTHING_SAVED, which is the exit status of the command."""
    output: Path | None
    """The new bag; None where none was needed or possible."""
    saved: int
    """Messages in the new bag, or in the old one when that is whole."""
    lost: dict[str, int]
    """Messages known to be lost, by topic."""
    reasons: tuple[str, ...]
    """What is damaged, one line each."""


def recover(path: Path, output: Path | None) -> Recovery:
    """Decode everything in a bag and write what is readable into a new bag with an index.

    A bag that is whole is left alone. From a chunk whose checksum is wrong, messages are saved as far as the
    chunk can be unpacked; `reasons` says so. The new bag's metadata record "recovery" repeats what was lost.

    Args:
        path: bag directory, .mcap or .db3 file.
        output: directory of the new bag, which must not exist; None to write nothing.

    Raises:
        BagError: the bag does not exist, or the output does.
    """
    unpack = unpacker(path) or bytes
    surveys = [_surveyed(file, unpack) for file in bag_files(path)]
    reasons = tuple(reason for survey in surveys for reason in survey.reasons) + tuple(missing_files(path))
    saved = sum(survey.saved.total() for survey in surveys)
    lost: Counter[str] = Counter()
    for survey in surveys:
        lost.update(survey.lost)
    if not saved:
        return Recovery(NOTHING_SAVED, None, 0, dict(lost), reasons or (f"{path}: holds no message",))
    if not reasons and all(survey.indexed for survey in surveys):
        return Recovery(WHOLE, None, saved, {}, ())
    reasons += tuple(_leave_out_other_types(surveys, lost))
    saved = sum(survey.saved.total() for survey in surveys)
    if output is not None:
        _write(surveys, output, {"source": str(path), "lost": str(dict(lost)), "reasons": "\n".join(reasons)})
    return Recovery(PARTLY_LOST if reasons else WHOLE, output, saved, dict(lost), reasons)


@dataclass
class _Survey:
    """What is readable of a file."""

    path: Path
    unpack: Unpack
    indexed: bool = False
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    saved: Counter[int] = field(default_factory=Counter)
    """Messages by channel."""
    lost: Counter[str] = field(default_factory=Counter)
    """Messages known to be missing, by topic."""
    reasons: list[str] = field(default_factory=list)
    misfits: dict[str, tuple[int, str]] = field(default_factory=dict)
    """By topic, how many messages do not fit their type, and where the first one stands."""

    def define(self, summary: Summary | None, reader: "SalvageReader | SqliteSalvage") -> None:
        """Take schemas and channels: from a summary if it repeats each, which it need not, or else from the data."""
        if summary is not None:
            self.schemas, self.channels = summary.schemas, summary.channels
            if _defines_all(summary):
                return
        for record in reader.records():  # a definition may stand behind messages of it, when the one before is lost
            if isinstance(record, Group):
                self.add_definitions(record)

    def note_misfits(self, group: Group, saved: Counter[int]) -> None:
        """Note the messages of a group that do not fit, after so many of each channel that do."""
        for record in group.records:
            if not isinstance(record, Message):
                continue
            if self._fits(record):
                saved[record.channel_id] += 1
                continue
            topic = self.channels[record.channel_id].topic
            place = f"message {saved[record.channel_id] + 1} of the topic, recorded at {record.log_time / 1e9:g} s"
            count, first = self.misfits.get(topic, (0, place))
            self.misfits[topic] = count + 1, first

    def add_definitions(self, group: Group) -> None:
        """Take the schemas and channels that are not known yet."""
        for record in group.records:
            if isinstance(record, Schema):
                self.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                self.channels.setdefault(record.id, record)

    def readable(self, group: Group) -> list[Message | Schema | Channel]:
        """Records of a group, without messages that do not fit their type: not every damage has a checksum."""
        return [record for record in group.records if not isinstance(record, Message) or self._fits(record)]

    def _fits(self, message: Message) -> bool:
        channel = self.channels.get(message.channel_id)
        if channel is None:
            return True
        try:
            kind = type_of(Series.of(self.schemas.get(channel.schema_id), channel))
        except BagError:  # nothing is known about it
            return True
        return kind.fits(self.unpack(message.data))

    def count(self, found: Counter[int], missing: Counter[int]) -> None:
        """Count as saved or lost what was found or is missing, by channel."""
        for channel_id, count in (+missing).items():
            channel = self.channels.get(channel_id)
            self.lost[channel.topic if channel else f"channel {channel_id}"] += count
        for channel_id, count in found.items():
            channel = self.channels.get(channel_id)
            if channel is not None and (not channel.schema_id or channel.schema_id in self.schemas):
                self.saved[channel_id] = count
            else:
                self.lost[f"channel {channel_id}"] += count
                self.reasons.append(f"{self.path}: the definition of channel {channel_id} is lost")


def _reader(path: Path, stream: BinaryIO) -> SalvageReader | SqliteSalvage:
    return SqliteSalvage(path) if path.suffix == ".db3" else SalvageReader(stream)


def _surveyed(path: Path, unpack: Unpack) -> _Survey:
    """Read a file, without keeping its messages."""
    survey = _Survey(path, unpack)
    found: Counter[int] = Counter()
    missing: Counter[int] = Counter()
    from_damaged: Counter[int] | None = None  # messages found in the chunk before, if that is damaged
    if path.suffix == COMPRESSED:
        raise BagError(f"{path}: is compressed as a whole; unpack it first, as by `zstd -d`")
    with path.open("rb") as stream:
        summary = verified_summary(stream)
        survey.define(summary, _reader(path, stream))
        reader = _reader(path, stream)
        for record in reader.records():
            match record:
                case Group():
                    before = found.copy()
                    survey.note_misfits(record, found)
                    counts = found - before
                    from_damaged = counts if record.damaged else None
                case MessageIndex() if from_damaged is not None:
                    missing[record.channel_id] += len(record.records) - from_damaged[record.channel_id]
                case Metadata():
                    survey.metadata[record.name] = record.metadata
                case Attachment():
                    survey.attachments[record.name] = record.data
        survey.reasons = reader.reasons
        survey.indexed = (summary is not None or isinstance(reader, SqliteSalvage)) and not reader.has_wrong_lengths
        if not data_section_is_intact(stream):
            survey.reasons.append(f"{path}: the checksum of its data section is wrong: parameters may be altered")
    survey.count(found, _missing(summary, found, missing))
    for topic, (count, first) in survey.misfits.items():
        survey.reasons.append(f"{path}: {count} messages of {topic} do not fit their type, first {first}")
        survey.lost[topic] = max(survey.lost[topic], count)
    return survey


def _defines_all(summary: Summary) -> bool:
    """Whether a summary has the channel of every message, and its schema."""
    if summary.statistics is None or not summary.statistics.channel_message_counts.keys() <= summary.channels.keys():
        return False
    return all(not each.schema_id or each.schema_id in summary.schemas for each in summary.channels.values())


def _missing(summary: Summary | None, found: Counter[int], indexed: Counter[int]) -> Counter[int]:
    """Messages missing by channel: by the summary of the file, or else by the indexes of damaged chunks."""
    if summary is None or summary.statistics is None:
        return indexed
    return Counter(summary.statistics.channel_message_counts) - found


def _leave_out_other_types(surveys: list[_Survey], lost: Counter[str]) -> Iterator[str]:
    """Leave out messages of another type than the first of their topic, since a new bag has one; yields a line each."""
    types: dict[str, tuple[str, bytes]] = {}
    for survey in surveys:
        for channel in survey.channels.values():
            schema = survey.schemas.get(channel.schema_id)
            kind = (schema.name, schema.data) if schema else ("", b"")
            count = survey.saved[channel.id]
            if count and types.setdefault(channel.topic, kind) != kind:
                del survey.saved[channel.id]
                lost[channel.topic] += count
                yield f"{survey.path}: topic {channel.topic} has messages of a second type, {kind[0] or 'unknown'}"


def _write(surveys: list[_Survey], output: Path, report: dict[str, str]) -> None:
    """Write everything readable into a new bag, whose messages are plain."""
    metadata = {name: values for survey in surveys for name, values in survey.metadata.items()}
    metadata.pop("rosbag2", None)
    attachments = {name: data for survey in surveys for name, data in survey.attachments.items()}
    with BagWriter(output, metadata | {"recovery": report}, attachments) as writer:
        added: set[str] = set()
        for survey in surveys:
            for channel in survey.channels.values():
                schema = survey.schemas.get(channel.schema_id)
                if (schema is not None or not channel.schema_id) and channel.topic not in added:
                    added.add(channel.topic)
                    writer.add_defined_topic(channel.topic, TopicDefinition.recorded(schema, channel))
            _copy_messages(survey, writer)


def _copy_messages(survey: _Survey, writer: BagWriter) -> None:
    with survey.path.open("rb") as stream:
        for record in _reader(survey.path, stream).records():
            for item in survey.readable(record) if isinstance(record, Group) else ():
                if isinstance(item, Message) and item.channel_id in survey.saved:
                    topic = survey.channels[item.channel_id].topic
                    writer.write(topic, survey.unpack(item.data), item.log_time, item.sequence)
