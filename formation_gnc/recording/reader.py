"""Reading bags: raw messages in bounded memory, decoded messages, and whole topics as NumPy arrays."""

import heapq
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, groupby, takewhile
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.recording.mcap_file import McapFile, mcap_files
from formation_gnc.recording.provenance import LOST

if TYPE_CHECKING:
    import pandas as pd

Arrays = dict[str, NDArray[Any]]
"""Messages of a topic: an array per field, a row per message."""


@dataclass(frozen=True)
class Topic:
    """A topic of a bag: its message type and its number of messages."""

    name: str
    type_name: str
    count: int


class Fields(Arrays):
    """Messages of a topic as arrays by field; raises BagError for a field that they lack."""

    def __init__(self, source: str, arrays: Arrays) -> None:
        """Hold the arrays of a source, which errors name."""
        super().__init__(arrays)
        self._source = source

    def __missing__(self, field: str) -> NoReturn:
        """Raise BagError."""
        raise BagError(f"{self._source}: no message has a field {field}")

    def elements(self, field: str) -> Iterator[str]:
        """Names of the elements of a list of messages, "readings.0" and so on, of the longest list."""
        names = (f"{field}.{index}" for index in count())
        return takewhile(lambda name: any(each.startswith(f"{name}.") for each in self), names)

    def integers(self, field: str) -> NDArray[np.int64]:
        """Values of a field of integers.

        Raises:
            BagError: it has another type, as in a bag of another version of the messages.
        """
        column = self[field]
        if column.dtype.kind not in "iu":
            raise BagError(f"{self._source}: field {field} is not of integers")
        return column.astype(np.int64)


class Bag:
    """A recorded bag: a directory of MCAP files as rosbag2 lays them out, or one .mcap file.

    Stamps are simulated time, ns.

    Attributes:
        topics: by name.
        metadata: MCAP metadata records by name, the provenance of the run among them.
        attachments: files carried in the bag, by name.
        start_ns, end_ns: first and last stamp; 0 and 0 when empty.
        damage: None, or the reason why the bag ends early, when its recorder could not finish it; everything
            before is read as usual.
        lost: number of messages that the recorder knows to have missed.

    Raises:
        BagError: here or while reading, when the path is missing, holds no MCAP file, or is damaged.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a bag by its directory or file."""
        self.path = Path(path)
        self._files = [McapFile(file) for file in mcap_files(self.path)]
        self.metadata = {name: data for file in self._files for name, data in file.metadata.items()}
        self.metadata.pop("rosbag2", None)  # rosbag2's own copy of metadata.yaml
        self.attachments = {name: data for file in self._files for name, data in file.attachments.items()}
        self.lost = sum(int(count) for count in self.metadata.get(LOST, {}).values())
        self.damage = next((file.damage for file in self._files if file.damage), None)
        spans = [span for file in self._files for span in file.spans]
        self.start_ns = min((span.start for span in spans), default=0)
        self.end_ns = max((span.end for span in spans), default=0)
        self.topics: dict[str, Topic] = {}
        self._definitions: dict[str, tuple[Schema | None, Channel]] = {}
        self._types: dict[str, MessageType] = {}
        for file in self._files:
            for channel in file.channels.values():
                schema = file.schemas.get(channel.schema_id)
                self._definitions.setdefault(channel.topic, (schema, channel))
                known = self.topics.get(channel.topic)
                count = file.counts[channel.id] + (known.count if known else 0)
                self.topics[channel.topic] = Topic(channel.topic, schema.name if schema else "", count)

    def messages(
        self, topics: Sequence[str] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[tuple[str, bytes, int]]:
        """Messages as (topic, CDR bytes, stamp in ns), in recorded order.

        Args:
            topics: None for all.
            start_ns: first stamp.
            end_ns: stamp before which to end.
        """
        wanted = self._known(topics)
        for file in self._files:
            names = {id: channel.topic for id, channel in file.channels.items() if channel.topic in wanted}
            for message in file.messages(names.keys(), start_ns, end_ns):
                yield names[message.channel_id], message.data, message.log_time

    def decoded(
        self, topics: Sequence[str] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[tuple[str, Any, int]]:
        """Messages as (topic, message with its fields as attributes, stamp in ns)."""
        for topic, data, stamp in self.messages(topics, start_ns, end_ns):
            yield topic, self.message_type(topic).message(data), stamp

    def arrays(self, topic: str, fields: Collection[str] | None = None) -> Fields:
        """All messages of a topic: an array per field, a row per message in recorded order.

        "stamp_ns" is the stamp (int64, ns), "time" the same in s; then the fields of the message as in
        `MessageType.arrays`.

        Args:
            topic: full name.
            fields: of the message, with what is nested in them; None for all.
        """
        return self._as_arrays(topic, [(data, stamp) for _, data, stamp in self.messages([topic])], fields)

    def batches(
        self, topics: Sequence[str], size: int = 1024, fields: Mapping[str, Collection[str]] | None = None
    ) -> Iterator[tuple[str, Fields]]:
        """Messages as (topic, `arrays` of some of them) in one pass, for bags of any length.

        Those of each topic come in recorded order.

        Args:
            topics: full names.
            size: most messages of a batch.
            fields: of the messages by topic, as for `arrays`; all of a topic without an entry.
        """
        wanted = fields or {}
        waiting: dict[str, list[tuple[bytes, int]]] = {topic: [] for topic in topics}
        for topic, data, stamp in self.messages(topics):
            rows = waiting[topic]
            rows.append((data, stamp))
            if len(rows) == size:
                waiting[topic] = []
                yield topic, self._as_arrays(topic, rows, wanted.get(topic))
        for topic, rows in waiting.items():
            if rows:
                yield topic, self._as_arrays(topic, rows, wanted.get(topic))

    def _as_arrays(self, topic: str, rows: list[tuple[bytes, int]], fields: Collection[str] | None) -> Fields:
        stamps = np.array([stamp for _, stamp in rows], dtype=np.int64)
        arrays = self.message_type(topic).arrays([data for data, _ in rows], fields)
        return Fields(f"{self.path}: topic {topic}", {"stamp_ns": stamps, "time": stamps * 1e-9, **arrays})

    def by_stamp(self, topics: Sequence[str]) -> Iterator[tuple[int, str, list[bytes]]]:
        """Canonical messages by (stamp, topic), sorted, also among those of one stamp and topic.

        Independent of the order in which processes answered. Holds in memory only messages that a later
        chunk may still precede.
        """
        wanted = self._known(topics)
        channels = {file: {id for id, each in file.channels.items() if each.topic in wanted} for file in self._files}
        spans = [(file, span) for file in self._files for span in file.spans]
        settled = [2**64]  # by span: every later message has at least this stamp
        for _, span in reversed(spans[1:]):
            settled.append(min(settled[-1], span.start))
        waiting: list[tuple[int, str, bytes]] = []

        def in_order() -> Iterator[tuple[int, str, bytes]]:
            for (file, span), limit in zip(spans, reversed(settled), strict=False):
                for message in file.span_messages(span, channels[file]):
                    topic = file.channels[message.channel_id].topic
                    data = self.message_type(topic).canonical(message.data)
                    heapq.heappush(waiting, (message.log_time, topic, data))
                while waiting and waiting[0][0] < limit:
                    yield heapq.heappop(waiting)

        for (stamp, topic), group in groupby(in_order(), key=itemgetter(0, 1)):
            yield stamp, topic, [data for _, _, data in group]

    def restarts(self, topics: Sequence[str]) -> dict[str, set[int]]:
        """Stamps (ns), by topic, of messages with which a publisher restarted its count."""
        found: dict[str, set[int]] = {topic: set() for topic in topics}
        seen: set[str] = set()
        for file in self._files:
            names = {id: channel.topic for id, channel in file.channels.items() if channel.topic in found}
            for message in file.messages(names.keys()):
                topic = names[message.channel_id]
                if message.sequence == 1 and topic in seen:
                    found[topic].add(message.log_time)
                seen.add(topic)
        return found

    def definition(self, topic: str) -> tuple[Schema | None, Channel]:
        """MCAP schema (None: there is none) and channel record of a topic, from the first file with it."""
        self._known([topic])
        return self._definitions[topic]

    def message_type(self, topic: str) -> MessageType:
        """Type of a topic's messages, by the definition in the bag.

        Raises:
            BagError: it has none, or its messages are not CDR.
        """
        if topic not in self._types:
            schema, channel = self.definition(topic)
            if schema is None or channel.message_encoding != "cdr":
                raise BagError(f"{self.path}: topic {topic} has no message definition, or is not CDR")
            self._types[topic] = MessageType(schema.name, schema.data, schema.encoding)
        return self._types[topic]

    def check_type(self, topic: str) -> None:
        """Raise BagError when a topic was recorded with other fields than the installed type has."""
        kind = self.message_type(topic)
        if not kind.has_fields_of(installed_type(kind.name)):
            raise BagError(
                f"{self.path}: topic {topic} was recorded with other fields in {kind.name} than are installed"
            )

    def _known(self, topics: Sequence[str] | None) -> set[str]:
        unknown = set(topics or ()) - self.topics.keys()
        if unknown:
            has = ", ".join(sorted(self.topics)) or "none"
            raise BagError(f"{self.path}: has no topic {', '.join(sorted(unknown))}; it has {has}")
        return set(self.topics if topics is None else topics)


def read(path: str | Path) -> dict[str, "pd.DataFrame"]:
    """All topics of a bag as pandas frames by topic, indexed by time (s), a column per array element.

    Raises:
        BagError: the bag cannot be read.
        ConfigurationError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise ConfigurationError("pandas is not installed: pip install pandas") from None
    bag = Bag(path)
    return {topic: pd.DataFrame(columns(bag.arrays(topic))).set_index("time") for topic in bag.topics}


def columns(arrays: Arrays) -> Arrays:
    """Stacked arrays as one column per element: "force" of shape (n, 3) as "force.0" to "force.2"."""
    flat = {}
    for field, array in arrays.items():
        if array.ndim == 1:
            flat[field] = array
        else:
            for index in range(array.shape[1]):
                flat[f"{field}.{index}"] = array[:, index]
    return flat
