"""Bag writer: MCAP files and metadata.yaml as rosbag2 Jazzy lays them out."""

import errno
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import indent
from types import TracebackType
from typing import BinaryIO, NoReturn, Self

from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer

from formation_gnc import __version__
from formation_gnc.errors import BagError
from formation_gnc.recording.bag_metadata import FileEntry, TopicEntry, bag_information
from formation_gnc.recording.topic_definition import TopicDefinition, qos_profiles

CHUNK_BYTES = 1 << 20
FLUSH_INTERVAL = 0.25
"""Longest wall time (s) between flushes to the disk while messages arrive."""

_MEDIA_TYPES = {".yaml": "application/yaml", ".json": "application/json"}


@dataclass(frozen=True)
class Split:
    """Limits at which a bag continues in a next file; None for no limit."""

    max_bytes: int | None = None
    """Bytes of messages on the disk."""
    max_duration: float | None = None
    """Simulated time, s."""

    def __post_init__(self) -> None:
        """Reject limits that are not positive."""
        for name, value in (("max_bytes", self.max_bytes), ("max_duration", self.max_duration)):
            if value is not None and not value > 0:
                raise BagError(f"split {name} = {value} is not allowed; it must be above 0")


@dataclass
class _OpenFile:
    """The file that messages go to."""

    stream: BinaryIO
    mcap: Writer
    entry: FileEntry
    overhead: int = 0
    """Bytes before the first message."""
    schemas: dict[tuple[str, str, bytes], int] = field(default_factory=dict)
    """Schema ids by message type, encoding and text."""
    channels: dict[str, int] = field(default_factory=dict)
    """Channel ids by topic."""


class BagWriter:
    """Writes a bag that rosbag2 Jazzy, Foxglove and Python's readers open as it is.

    Messages keep the order in which they are written, and are stamped with simulated time alone: the same
    run gives the same messages. Messages reach the disk within FLUSH_INTERVAL of wall time while others
    follow; call `flush` on a timer for the times when none do.

    Every method raises OSError, naming the file, when the disk fails; what was written before stays readable.
    """

    def __init__(
        self,
        directory: Path,
        provenance: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes] | None = None,
        split: Split | None = None,
    ) -> None:
        """Make the directory and start the first file.

        Args:
            directory: must not exist; will hold `<name>_0.mcap` and so on, and `metadata.yaml`.
            provenance: MCAP metadata records by name.
            attachments: files to carry in the bag, by file name.
            split: when to continue in a next file.

        Raises:
            BagError: the directory exists or cannot be made.
        """
        self.directory = Path(directory).absolute()
        self._metadata = {name: dict(values) for name, values in provenance.items()}
        self._attachments = dict(attachments or {})
        self._split = split
        self._topics: dict[str, TopicEntry] = {}
        self._files: list[FileEntry] = []
        self._unwritten = False  # records that are not on the disk yet
        self._unlisted = False  # topics or files that metadata.yaml does not name yet
        self._closed = False
        try:
            self.directory.mkdir(parents=True)
        except FileExistsError:
            raise BagError(f"bag directory {self.directory}: exists already; name another or remove it") from None
        except OSError as error:
            raise BagError(f"bag directory {self.directory}: cannot be made: {error.strerror}") from None
        with self._guarded():
            self._start_file()

    def add_topic(self, topic: str, type_name: str, depth: int) -> None:
        """Add a topic of an installed message type, with the project's QoS at this queue depth.

        Raises:
            BagError: the type is not installed, or the topic was added before.
        """
        self.add_defined_topic(topic, TopicDefinition.installed(type_name, depth))

    def add_defined_topic(self, topic: str, definition: TopicDefinition) -> None:
        """Add a topic with a given definition, such as one read from another bag.

        Raises:
            BagError: the topic was added before.
        """
        if topic in self._topics:
            raise BagError(f"topic {topic!r}: already in the bag {self.directory}")
        qos = qos_profiles(definition.metadata)
        with self._guarded():
            self._register(topic, definition)
        self._topics[topic] = TopicEntry(definition, qos)
        self._unwritten = self._unlisted = True

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add an MCAP metadata record, such as the counters of a run at its end."""
        self._metadata[name] = dict(values)
        with self._guarded():
            self._file.mcap.add_metadata(name, self._metadata[name])
        self._unwritten = True

    def add_attachment(self, name: str, data: bytes) -> None:
        """Add a file to carry in the bag."""
        self._attachments[name] = data
        with self._guarded():
            self._attach(name)
        self._unwritten = True

    def begin_file(self) -> None:
        """Continue in a next file, unless the current one has no message yet."""
        if self._file.entry.count:
            with self._guarded():
                self._finish_file()
                self._start_file()

    def write(self, topic: str, data: bytes, stamp_ns: int, sequence: int) -> None:
        """Append one serialized message.

        Args:
            topic: one that was added.
            data: CDR bytes.
            stamp_ns: simulated time, ns, not negative.
            sequence: the publisher's count; the file keeps its lower 32 bits.

        Raises:
            BagError: the stamp is negative, the topic was not added, or the bag is closed.
        """
        try:
            topic_entry = self._topics[topic]
        except KeyError:
            raise BagError(f"topic {topic!r}: was not added, or the bag is closed") from None
        if stamp_ns < 0:
            raise BagError(f"topic {topic!r}: stamp {stamp_ns} ns is not allowed; it must be at least 0")
        if self._split is not None and self._is_full(self._split, stamp_ns):
            self.begin_file()
        file = self._file
        try:
            file.mcap.add_message(file.channels[topic], stamp_ns, data, stamp_ns, sequence & 0xFFFFFFFF)
        except OSError as error:  # not `_guarded`: this is the hot path
            self._fail(error)
        self._unwritten = True
        topic_entry.count += 1
        entry = file.entry
        entry.count += 1
        if stamp_ns < entry.start:
            entry.start = stamp_ns
        if stamp_ns > entry.end:
            entry.end = stamp_ns
        if time.monotonic() > self._flush_due:
            self.flush()

    def flush(self) -> None:
        """Write everything to the disk, safe from a power cut."""
        if not self._closed:
            with self._guarded():
                self._flush()

    def close(self) -> None:
        """Finish the bag: index, summary and metadata.yaml. Does nothing the second time."""
        if not self._closed:
            with self._guarded():
                self._finish_file()
                self._write_metadata()
            self._closed = True
            self._topics.clear()

    def __enter__(self) -> Self:
        """Enter a block at whose end the bag is closed."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bag, also after an error in the block."""
        self.close()

    def _start_file(self) -> None:
        entry = FileEntry(f"{self.directory.name}_{len(self._files)}.mcap")
        stream = (self.directory / entry.name).open("xb")
        limit = self._split.max_bytes if self._split is not None else None
        chunk_bytes = CHUNK_BYTES if limit is None else min(CHUNK_BYTES, limit)
        mcap = Writer(stream, chunk_size=chunk_bytes, compression=CompressionType.ZSTD, enable_data_crcs=True)
        mcap.start(profile="ros2", library=f"formation_gnc {__version__}, {LIBRARY_IDENTIFIER}")
        for name, values in self._metadata.items():
            mcap.add_metadata(name, values)
        self._file = _OpenFile(stream, mcap, entry)
        for name in self._attachments:
            self._attach(name)
        self._file.overhead = stream.tell()
        self._files.append(entry)
        for topic, known in self._topics.items():
            self._register(topic, known.definition)
        self._unwritten = self._unlisted = True
        self._flush()

    def _attach(self, name: str) -> None:
        media_type = _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream")
        self._file.mcap.add_attachment(
            create_time=0, log_time=0, name=name, media_type=media_type, data=self._attachments[name]
        )

    def _register(self, topic: str, definition: TopicDefinition) -> None:
        """Give the topic a channel in the current file."""
        file = self._file
        known = definition.type_name, definition.schema_encoding, definition.schema
        schema = file.schemas.get(known) if any(known) else 0
        if schema is None:
            schema = file.schemas[known] = file.mcap.register_schema(*known)
        metadata = dict(definition.metadata)
        file.channels[topic] = file.mcap.register_channel(topic, definition.message_encoding, schema, metadata)

    def _is_full(self, split: Split, stamp_ns: int) -> bool:
        file = self._file
        if split.max_duration is not None and stamp_ns - file.entry.start >= split.max_duration * 1e9:
            return True
        return split.max_bytes is not None and file.stream.tell() - file.overhead >= split.max_bytes

    def _flush(self) -> None:
        if self._unwritten:
            self._file.mcap.flush()  # type: ignore[no-untyped-call]
            if os.fstat(self._file.stream.fileno()).st_nlink == 0:
                raise OSError(errno.ENOENT, "its file has been deleted")
            os.fdatasync(self._file.stream.fileno())
        if self._unlisted:
            self._write_metadata()
        self._unwritten = self._unlisted = False
        self._flush_due = time.monotonic() + FLUSH_INTERVAL

    def _finish_file(self) -> None:
        file = self._file
        file.mcap.add_metadata("rosbag2", {"serialized_metadata": bag_information(self._topics, self._files)})
        file.mcap.finish()  # type: ignore[no-untyped-call]
        file.stream.flush()
        os.fdatasync(file.stream.fileno())
        file.stream.close()

    def _write_metadata(self) -> None:
        """Replace metadata.yaml atomically."""
        partial = self.directory / "metadata.yaml.partial"
        text = "rosbag2_bagfile_information:\n" + indent(bag_information(self._topics, self._files), "  ")
        partial.write_text(text, encoding="utf-8")
        partial.replace(self.directory / "metadata.yaml")

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        """Abandon the bag; `recover` saves what is on the disk."""
        self._closed = True
        self._topics.clear()
        with suppress(OSError):
            self._file.stream.close()
        raise OSError(
            error.errno,
            f"bag cut short: {error.strerror}; `recover` saves what was written",
            str(self.directory),
        ) from error
