"""The bag writer: MCAP files and metadata.yaml as rosbag2 Jazzy lays them out."""

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import indent
from types import TracebackType
from typing import Any, BinaryIO, NoReturn, Self

import yaml
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer

from formation_gnc import __version__
from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.schema import schema_text, type_hash

CHUNK_BYTES = 1 << 20
FLUSH_INTERVAL = 0.25
"""Wall time in s after which a written message is on the disk; a timer that calls `flush` uses it too."""

_EMPTY_START = 2**63 - 1  # rosbag2's starting time of a bag without messages
_Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_MEDIA_TYPES = {".yaml": "application/yaml", ".json": "application/json"}
_INFINITE = "{sec: 9223372036, nsec: 854775807}"
_OFFERED_QOS = f"""\
- history: keep_last
  depth: %d
  reliability: reliable
  durability: transient_local
  deadline: {_INFINITE}
  lifespan: {_INFINITE}
  liveliness: automatic
  liveliness_lease_duration: {_INFINITE}
  avoid_ros_namespace_conventions: false
"""


@dataclass(frozen=True)
class Split:
    """When a bag goes on in a next file: past so many bytes of messages on disk, or s of simulated time."""

    max_bytes: int | None = None
    max_duration: float | None = None

    def __post_init__(self) -> None:
        """Reject limits that no file can keep."""
        for name, value in (("max_bytes", self.max_bytes), ("max_duration", self.max_duration)):
            if value is not None and not value > 0:
                raise ConfigurationError(f"split {name} = {value}: must be above 0")


@dataclass(frozen=True)
class TopicDefinition:
    """What a bag says of a topic: its type, the type's definition and rosbag2's channel metadata."""

    type_name: str
    schema: bytes
    schema_encoding: str = "ros2msg"
    message_encoding: str = "cdr"
    metadata: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def installed(cls, type_name: str, depth: int) -> Self:
        """Definition from the installed message packages, offered reliable, transient-local, keep-last.

        Raises ConfigurationError when the type is not installed or the depth is not positive.
        """
        if depth < 1:
            raise ConfigurationError(f"queue depth {depth}: must be at least 1")
        metadata = {"offered_qos_profiles": _OFFERED_QOS % depth, "topic_type_hash": type_hash(type_name)}
        return cls(type_name, schema_text(type_name).encode(), metadata=metadata)


@dataclass
class _Topic:
    definition: TopicDefinition
    qos: Any
    channel: int
    count: int = 0


@dataclass
class _File:
    """One MCAP file of the bag, the bytes before its first message, and what metadata.yaml says of it."""

    path: Path
    stream: BinaryIO
    mcap: Writer
    overhead: int
    schemas: dict[str, int] = field(default_factory=dict)
    count: int = 0
    start: int = _EMPTY_START
    end: int = 0


class BagWriter:
    """Writes a bag that rosbag2 Jazzy, Foxglove and Python's readers open unprepared.

    Messages keep the order they are written in, and are stamped with simulated time alone, so the same
    run gives the same messages. At most FLUSH_INTERVAL of wall time is not yet on the disk while messages
    arrive; call `flush` on a timer for the times when none do.

    directory: must not exist yet; holds `<name>_0.mcap` and so on, and `metadata.yaml`.
    provenance: MCAP metadata records by name.
    attachments: files carried in the bag, by file name.
    Raises ConfigurationError when the directory exists or cannot be made. Every method raises OSError,
    naming the file, when the disk fails; what was written before stays readable.
    """

    def __init__(
        self,
        directory: Path,
        provenance: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes] | None = None,
        split: Split | None = None,
    ) -> None:
        """Make the directory and start its first file."""
        self.directory = Path(directory).absolute()
        self._metadata = {name: dict(values) for name, values in provenance.items()}
        self._attachments = dict(attachments or {})
        self._split = split
        self._topics: dict[str, _Topic] = {}
        self._files: list[_File] = []
        self._unwritten = False  # records that are not on the disk yet
        self._unlisted = False  # topics or files that metadata.yaml does not name yet
        self._closed = False
        try:
            self.directory.mkdir(parents=True)
        except FileExistsError:
            raise ConfigurationError(
                f"bag directory {self.directory}: exists already; name another or remove it"
            ) from None
        except OSError as error:
            raise ConfigurationError(f"bag directory {self.directory}: cannot be made: {error.strerror}") from None
        with self._guarded():
            self._start_file()

    def add_topic(self, topic: str, type_name: str, depth: int) -> None:
        """Add a topic of an installed message type, offered with the project's QoS at this queue depth.

        Raises ConfigurationError when the type is not installed or the topic was added before.
        """
        self.add_defined_topic(topic, TopicDefinition.installed(type_name, depth))

    def add_defined_topic(self, topic: str, definition: TopicDefinition) -> None:
        """Add a topic with a definition of its own, such as one read from another bag."""
        if topic in self._topics:
            raise ConfigurationError(f"topic {topic!r}: is already in the bag {self.directory}")
        qos = yaml.safe_load(definition.metadata.get("offered_qos_profiles", "[]"))
        with self._guarded():
            self._topics[topic] = _Topic(definition, qos, self._register(topic, definition))
        self._unwritten = self._unlisted = True

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add an MCAP metadata record, such as the counters of the run before `close`."""
        self._metadata[name] = dict(values)
        with self._guarded():
            self._file.mcap.add_metadata(name, self._metadata[name])
        self._unwritten = True

    def add_attachment(self, name: str, data: bytes) -> None:
        """Add a file to be carried in the bag."""
        self._attachments[name] = data
        with self._guarded():
            self._attach(name)
        self._unwritten = True

    def begin_file(self) -> None:
        """Let the bag go on in a next file, unless the last one has no message yet."""
        if self._file.count:
            with self._guarded():
                self._finish_file()
                self._start_file()

    def write(self, topic: str, data: bytes, stamp_ns: int, sequence: int) -> None:
        """Append one serialised message.

        data: its CDR bytes as they came. stamp_ns: simulated time in ns, not negative. sequence: the
        publisher's count, of which the file keeps the lower 32 bits.
        Raises ConfigurationError when the stamp is negative, the topic was not added or the bag is closed.
        """
        try:
            entry = self._topics[topic]
        except KeyError:
            raise ConfigurationError(f"topic {topic!r}: was not added, or the bag is closed") from None
        if stamp_ns < 0:
            raise ConfigurationError(f"topic {topic!r}: stamp {stamp_ns} ns: must not be negative")
        if self._split is not None and self._is_full(self._split, stamp_ns):
            self.begin_file()
        file = self._file
        try:
            file.mcap.add_message(entry.channel, stamp_ns, data, stamp_ns, sequence & 0xFFFFFFFF)
        except OSError as error:  # not `_guarded`: this is the hot path
            self._fail(error)
        self._unwritten = True
        entry.count += 1
        file.count += 1
        if stamp_ns < file.start:
            file.start = stamp_ns
        if stamp_ns > file.end:
            file.end = stamp_ns
        if time.monotonic() > self._flush_due:
            self.flush()

    def flush(self) -> None:
        """Bring everything written so far to the disk, where a power cut does not reach it."""
        if not self._closed:
            with self._guarded():
                self._flush()

    def close(self) -> None:
        """Finish the bag: its index, its summary and metadata.yaml. Closing twice does no harm."""
        if not self._closed:
            with self._guarded():
                self._finish_file()
                self._write_metadata()
            self._closed = True
            self._topics.clear()

    def __enter__(self) -> Self:
        """Use as a context manager, closed at the end of the block."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bag, also when the block failed."""
        self.close()

    def _start_file(self) -> None:
        path = self.directory / f"{self.directory.name}_{len(self._files)}.mcap"
        stream = path.open("xb")
        limit = self._split.max_bytes if self._split is not None else None
        chunk_bytes = CHUNK_BYTES if limit is None else min(CHUNK_BYTES, limit)
        mcap = Writer(stream, chunk_size=chunk_bytes, compression=CompressionType.ZSTD, enable_data_crcs=True)
        mcap.start(profile="ros2", library=f"formation_gnc {__version__}, {LIBRARY_IDENTIFIER}")
        for name, values in self._metadata.items():
            mcap.add_metadata(name, values)
        self._file = _File(path, stream, mcap, overhead=0)
        for name in self._attachments:
            self._attach(name)
        self._file.overhead = stream.tell()
        self._files.append(self._file)
        for topic, entry in self._topics.items():
            entry.channel = self._register(topic, entry.definition)
        self._unwritten = self._unlisted = True
        self._flush()

    def _attach(self, name: str) -> None:
        media_type = _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream")
        self._file.mcap.add_attachment(
            create_time=0, log_time=0, name=name, media_type=media_type, data=self._attachments[name]
        )

    def _register(self, topic: str, definition: TopicDefinition) -> int:
        file = self._file
        schema = file.schemas.get(definition.type_name)
        if schema is None:
            schema = file.mcap.register_schema(definition.type_name, definition.schema_encoding, definition.schema)
            file.schemas[definition.type_name] = schema
        return file.mcap.register_channel(topic, definition.message_encoding, schema, dict(definition.metadata))

    def _is_full(self, split: Split, stamp_ns: int) -> bool:
        file = self._file
        if split.max_duration is not None and stamp_ns - file.start >= split.max_duration * 1e9:
            return True
        return split.max_bytes is not None and file.stream.tell() - file.overhead >= split.max_bytes

    def _flush(self) -> None:
        if self._unwritten:
            self._file.mcap.flush()  # type: ignore[no-untyped-call]
            os.fdatasync(self._file.stream.fileno())
        if self._unlisted:
            self._write_metadata()
        self._unwritten = self._unlisted = False
        self._flush_due = time.monotonic() + FLUSH_INTERVAL

    def _finish_file(self) -> None:
        file = self._file
        file.mcap.add_metadata("rosbag2", {"serialized_metadata": self._information()})
        file.mcap.finish()  # type: ignore[no-untyped-call]
        file.stream.flush()
        os.fdatasync(file.stream.fileno())
        file.stream.close()

    def _write_metadata(self) -> None:
        """Replace metadata.yaml in one step, so that it is whole at any moment."""
        partial = self.directory / "metadata.yaml.partial"
        text = "rosbag2_bagfile_information:\n" + indent(self._information(), "  ")
        partial.write_text(text, encoding="utf-8")
        partial.replace(self.directory / "metadata.yaml")

    def _information(self) -> str:
        """The bag's description in rosbag2's YAML."""
        topics = [
            {
                "topic_metadata": {
                    "name": name,
                    "type": entry.definition.type_name,
                    "serialization_format": entry.definition.message_encoding,
                    "offered_qos_profiles": entry.qos,
                    "type_description_hash": entry.definition.metadata.get("topic_type_hash", ""),
                },
                "message_count": entry.count,
            }
            for name, entry in self._topics.items()
        ]
        files = [{"path": file.path.name, **_span([file]), "message_count": file.count} for file in self._files]
        information = {
            "version": 9,
            "storage_identifier": "mcap",
            **_span(self._files),
            "message_count": sum(file.count for file in self._files),
            "topics_with_message_count": topics,
            "compression_format": "",  # of whole files: MCAP compresses its chunks by itself
            "compression_mode": "",
            "relative_file_paths": [file.path.name for file in self._files],
            "files": files,
            "custom_data": None,
            "ros_distro": "jazzy",
        }
        return str(yaml.dump(information, Dumper=_Dumper, sort_keys=False))

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        """End the bag where it stands: what is on the disk is left for `recover`."""
        self._closed = True
        self._topics.clear()
        with suppress(OSError):
            self._file.stream.close()
        raise OSError(
            error.errno,
            f"bag cut short: {error.strerror}; `recover` saves what was written",
            str(self.directory),
        ) from error


def _span(files: list[_File]) -> dict[str, dict[str, int]]:
    start = min(file.start for file in files)
    end = max(file.end for file in files)
    return {
        "starting_time": {"nanoseconds_since_epoch": start},
        "duration": {"nanoseconds": max(end - start, 0)},
    }
