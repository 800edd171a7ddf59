"""What every file of a bag offers, whatever its storage: its series of messages, in recorded order and by span."""

from array import array
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from struct import Struct
from typing import NamedTuple

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.messages.definitions import schema_text
from formation_gnc.recording.decode import CLOCK, MessageType
from formation_gnc.types import NANOSECONDS

OWN_PACKAGE = "formation_gnc_msgs/"

_TIME = {b"\0\0": Struct(">iI"), b"\0\1": Struct("<iI")}
"""Seconds and nanoseconds of a stamp, by the encapsulation of plain CDR."""
_BODY = 4  # bytes before the body of a message
_LARGEST = 2**63 - 1
_LATEST = 2**62  # beyond any header's stamp: of a run's message that is too short for one, received later still


class Series(NamedTuple):
    """Messages of a topic that are laid out alike."""

    topic: str
    type_name: str
    schema: bytes
    schema_encoding: str
    message_encoding: str

    @classmethod
    def of(cls, schema: Schema | None, channel: Channel) -> "Series":
        """The series of a channel; without a schema, of no type."""
        name, text, encoding = (schema.name, schema.data, schema.encoding) if schema else ("", b"", "")
        return cls(channel.topic, name, text, encoding, channel.message_encoding)

    @property
    def is_own(self) -> bool:
        """Whether its stamps are the ticks of a run: one of the project's types, or the clock."""
        return self.type_name.startswith(OWN_PACKAGE) or (self.topic, self.type_name) == (topics.CLOCK.name, CLOCK)


def type_of(series: Series) -> MessageType:
    """Message type of a series, by the definition in the bag, else by the installed one of its name.

    Raises:
        BagError: it has neither, or its messages are not CDR.
    """
    if series.message_encoding != "cdr":
        raise BagError(f"messages are {series.message_encoding or 'of no encoding'}, not CDR")
    if series.schema:
        return _defined_type(series.type_name, series.schema, series.schema_encoding)
    if not series.type_name:
        raise BagError("has no message definition")
    return _defined_type(series.type_name, schema_text(series.type_name).encode(), "ros2msg")


@lru_cache(maxsize=256)
def _defined_type(name: str, schema: bytes, encoding: str) -> MessageType:
    """A message type, parsed once however many topics have it; raises BagError."""
    return MessageType(name, schema, encoding)


class BagMessage(NamedTuple):
    """A message of a bag."""

    topic: str
    row: int
    """Its place among those of its topic."""
    stamp: int
    """ns."""
    data: bytes
    sequence: int


@dataclass
class Span:
    """Part of a file that is read at once: a chunk, or a whole file with messages outside chunks."""

    offset: int | None
    """Byte at which the chunk begins; None for the whole file."""
    start: int = 2**64
    """First stamp, ns."""
    end: int = -(2**64)
    """Last stamp, ns."""
    first: Mapping[Series, int] = field(default_factory=dict)
    """Row of each series' first message."""
    series: set[Series] = field(default_factory=set)
    """Those with messages in it."""


class _Stamps:
    """Stamps of one series in recorded order."""

    def __init__(self, series: Series) -> None:
        self.topic = series.topic
        self.values = array("q")
        self.is_unsigned = False
        self.is_own = series.is_own
        self.repeats = 0
        """Messages equal to one before them with the same stamp."""
        self.misfits = 0
        """Messages that are none of the type: cut, or encoded otherwise."""
        self.first_misfit = ""
        """Where the first of them stands, in words."""
        self._same: list[bytes] = []
        self._kind: MessageType | None = None
        with suppress(BagError):
            self._kind = type_of(series)
        self.has_header = self._kind is not None and self._kind.is_stamped

    def fits(self, data: bytes) -> bool:
        """Whether a message is one of the type."""
        return self._kind is None or self._kind.fits(data)

    def add(self, stamp: int, data: bytes) -> None:
        values = self.values
        if self.is_own:
            if values and values[-1] == stamp:
                self.repeats += data in self._same
                self._same.append(data)
            else:
                self._same = [data]
            stamp = min(stamp, _LATEST)
        if stamp > _LARGEST:
            self.is_unsigned = True
            stamp -= 2**64
        values.append(stamp)


@dataclass(slots=True)
class _Cursor:
    """Place in a series while a span is read."""

    stamps: _Stamps
    row: int
    """Of the next message, in the file."""
    offset: int
    """Row in the bag of the file's first message."""


class StoredFile:
    """One file of a bag, scanned when it is opened and read span by span in bounded memory.

    A message's stamp is that of its header, or its log time where it has none. Where the log times are those of
    reception, a message without header has the latest stamp of the run.

    Attributes:
        path: as errors name it.
        definitions: schema (None: there is none) and channel of each series.
        spans: in file order.
        metadata, attachments: by name, the last of each.
        damage: None for a finished file, else the reason why it ends early; everything before is read.
        orphans: messages of channels that the file does not define.
    """

    def __init__(self, path: Path, unpack: Callable[[bytes], bytes] | None = None) -> None:
        """Start empty.

        Args:
            path: of the file.
            unpack: decompresses each message; None where they are not compressed.
        """
        self.path, self._unpack = path, unpack or bytes
        self.definitions: dict[Series, tuple[Schema | None, Channel]] = {}
        self.spans: list[Span] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.damage: str | None = None
        self.orphans = 0
        self.copy: object = None  # kept while the file is read
        self._stamps: dict[Series, _Stamps] = {}
        self._channels: dict[int, Series] = {}
        self._channels_of: dict[Series, list[int]] = {}
        self._latest: tuple[int, int] | None = None  # stamp and log time of the run's latest message

    def messages(self, span: Span, wanted: Mapping[Series, int]) -> Iterator[BagMessage]:
        """Messages of some series in one span, in recorded order.

        Args:
            span: to read.
            wanted: row of the file's first message of each series.

        Raises:
            BagError: the file is damaged.
        """
        cursors = {
            series: _Cursor(self._stamps[series], span.first.get(series, 0), wanted[series]) for series in wanted
        }
        cursor_of = {channel: cursors[series] for series in wanted for channel in self._channels_of[series]}
        for channel, data, sequence in self._span_records(span, cursor_of):
            cursor = cursor_of[channel]
            stamps, row = cursor.stamps, cursor.row
            if stamps.fits(data) and row < len(stamps.values):
                cursor.row = row + 1
                stamp = stamps.values[row]
                if stamp < 0 and stamps.is_unsigned:
                    stamp += 2**64
                yield BagMessage(stamps.topic, cursor.offset + row, stamp, data, sequence)

    def stamps(self, series: Series) -> NDArray[np.int64]:
        """Stamps (ns) of a series in recorded order; uint64 when one is beyond 64 bits with sign."""
        known = self._stamps.get(series)
        if known is None:
            return np.zeros(0, dtype=np.int64)
        values = np.frombuffer(known.values, dtype=np.int64)
        return values.view(np.uint64) if known.is_unsigned else values  # type: ignore[return-value]

    def misfits(self, series: Series) -> int:
        """Messages of a series that are left out, being none of its type."""
        return self._stamps[series].misfits if series in self._stamps else 0

    def first_misfit(self, series: Series) -> str:
        """Where the first of them stands, in words."""
        return self._stamps[series].first_misfit if series in self._stamps else ""

    def repeats(self, series: Series) -> int:
        """Messages of a series equal to one right before them."""
        return self._stamps[series].repeats if series in self._stamps else 0

    def _span_records(self, span: Span, channels: Collection[int]) -> Iterable[tuple[int, bytes, int]]:
        """Channel, data and sequence number of the messages of some channels in a span."""
        raise NotImplementedError

    def _define(self, schema: Schema | None, channel: Channel) -> None:
        """Take the definition of a channel; the first counts."""
        if channel.id not in self._channels:
            series = Series.of(schema, channel)
            self._channels[channel.id] = series
            self._channels_of.setdefault(series, []).append(channel.id)
            self.definitions.setdefault(series, (schema, channel))
            self._stamps.setdefault(series, _Stamps(series))

    def _begin_span(self, offset: int | None) -> Span:
        span = Span(offset, first={series: len(stamps.values) for series, stamps in self._stamps.items()})
        self.spans.append(span)
        return span

    def _note(self, span: Span, channel: int, data: bytes, log_time: int) -> None:
        """Note the stamp of the next message."""
        series = self._channels.get(channel)
        if series is None:
            self.orphans += 1
            return
        stamps, data = self._stamps[series], self._unpack(data)
        if not stamps.fits(data):
            stamps.misfits += 1
            if stamps.misfits == 1:
                place = f"message {len(stamps.values) + 1} of the topic in {self.path.name}"
                stamps.first_misfit = f"{place}, {len(data)} bytes, recorded at {log_time / NANOSECONDS:g} s"
            return
        stamp = log_time
        if stamps.has_header:
            stamp = self._header_stamp(data, log_time, stamps.is_own)
            if stamps.is_own and stamp >= 0:
                if self._latest is None and stamp != log_time:
                    self._restamp(stamp)
                self._latest = stamp, log_time
        elif self._latest is not None and self._latest[0] != self._latest[1]:
            stamp = self._latest[0]
        stamps.add(stamp, data)
        span.series.add(series)
        if stamp < span.start:
            span.start = stamp
        if stamp > span.end:
            span.end = stamp

    @staticmethod
    def _header_stamp(data: bytes, log_time: int, is_own: bool) -> int:
        """Stamp in the header; the log time of others' messages whose header is not set."""
        seconds, nanoseconds = _TIME[data[:2]].unpack_from(data, _BODY)
        stamp = int(seconds) * NANOSECONDS + int(nanoseconds)
        return stamp if stamp > 0 or (is_own and stamp == 0) else log_time

    def _restamp(self, stamp: int) -> None:
        """Give the messages before the run's first one its stamp: they were stamped as received."""
        for stamps in self._stamps.values():
            if not stamps.has_header:
                stamps.values = array("q", [stamp] * len(stamps.values))
                stamps.is_unsigned = False
        for span in self.spans:
            span.start, span.end = min(span.start, stamp), stamp
