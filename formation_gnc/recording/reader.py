"""Reading bags: raw messages in bounded memory, typed messages, and whole topics as NumPy arrays."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.recording.mcap_file import McapFile, mcap_files
from formation_gnc.recording.provenance import LOST

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Topic:
    """What a bag holds of a topic: its type and the number of its messages."""

    name: str
    type_name: str
    count: int


@dataclass(frozen=True)
class Difference:
    """The first difference of two bags on a topic: its stamp in ns, the field, and what each bag has there.

    field is "" where a message or the topic is missing altogether, its value then None.
    """

    topic: str
    stamp_ns: int
    field: str
    first: Any
    second: Any

    def __str__(self) -> str:
        """One line for people."""
        place = f"{self.topic} at {self.stamp_ns / 1e9:.9f} s"
        if not self.field:
            return f"{place}: only in the {'first' if self.second is None else 'second'} bag"
        return f"{place}: {self.field} is {self.first} and {self.second}"


class Fields(dict[str, NDArray[Any]]):
    """Arrays by field; asked for one that the messages of the topic lack, it says so."""

    def __init__(self, place: str, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the arrays of a place, which errors name."""
        super().__init__(arrays)
        self._place = place

    def __missing__(self, field: str) -> NoReturn:
        """Raise ConfigurationError."""
        raise ConfigurationError(f"{self._place}: no message has a field {field}")


class Bag:
    """A recorded bag: a directory of MCAP files as rosbag2 lays them out, or one bare .mcap file.

    topics: by name. metadata: MCAP metadata records by name, the provenance of the run among them.
    attachments: files carried in the bag. start_ns, end_ns: first and last stamp (0 and 0 when empty).
    damage: None, or why the bag ends where it ends, when its recorder could not finish it; everything before
    is read as usual. lost: messages that the recorder knows to have missed. Stamps are simulated time in ns.
    Raises ConfigurationError, here or while reading, when the path is missing, holds no MCAP file, or is
    damaged.
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
        """Messages as (topic, CDR bytes, stamp in ns), in the order they were recorded.

        topics: None for all. start_ns, end_ns: only stamps in [start_ns, end_ns).
        """
        wanted = self._known(topics)
        for file in self._files:
            names = {id: channel.topic for id, channel in file.channels.items() if channel.topic in wanted}
            for message in file.messages(names.keys(), start_ns, end_ns):
                yield names[message.channel_id], message.data, message.log_time

    def decoded(
        self, topics: Sequence[str] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[tuple[str, Any, int]]:
        """Messages as (topic, message, stamp in ns), with the message's fields as attributes."""
        for topic, data, stamp in self.messages(topics, start_ns, end_ns):
            yield topic, self._type(topic).message(data), stamp

    def arrays(self, topic: str) -> dict[str, NDArray[Any]]:
        """All messages of a topic as one array per field, a row per message in recorded order.

        "stamp_ns" is the stamp (int64, ns) and "time" the same in s; then every field of the message,
        nested ones dotted and fixed arrays stacked, as MessageType.arrays has them.
        """
        return self._as_arrays(topic, [(data, stamp) for _, data, stamp in self.messages([topic])])

    def batches(self, topics: Sequence[str], size: int = 1024) -> Iterator[tuple[str, dict[str, NDArray[Any]]]]:
        """Messages as (topic, `arrays` of some of them), in one reading, for bags of any length.

        Each topic's come in recorded order, `size` at a time.
        """
        waiting: dict[str, list[tuple[bytes, int]]] = {topic: [] for topic in topics}
        for topic, data, stamp in self.messages(topics):
            rows = waiting[topic]
            rows.append((data, stamp))
            if len(rows) == size:
                waiting[topic] = []
                yield topic, self._as_arrays(topic, rows)
        for topic, rows in waiting.items():
            if rows:
                yield topic, self._as_arrays(topic, rows)

    def _as_arrays(self, topic: str, rows: list[tuple[bytes, int]]) -> dict[str, NDArray[Any]]:
        stamps = np.array([stamp for _, stamp in rows], dtype=np.int64)
        fields = self._type(topic).arrays([data for data, _ in rows])
        place = f"{self.path}: topic {topic}"
        return Fields(place, {"stamp_ns": stamps, "time": stamps * 1e-9, **fields})

    def by_stamp(self, topics: Sequence[str]) -> Iterator[tuple[int, str, list[bytes]]]:
        """Canonical messages by (stamp, topic), sorted, those of one stamp and topic together and sorted too.

        So neither the order in which processes happened to answer nor the memory between the fields shows.
        Holds only messages that a later chunk could still precede.
        """
        wanted = self._known(topics)
        spans = [(file, span) for file in self._files for span in file.spans]
        settled = [2**64]  # by span: every later message has at least this stamp
        for _, span in reversed(spans[1:]):
            settled.append(min(settled[-1], span.start))
        waiting: list[tuple[int, str, bytes]] = []

        def in_order() -> Iterator[tuple[int, str, bytes]]:
            for (file, span), limit in zip(spans, reversed(settled), strict=False):
                for message in file.span_messages(span):
                    channel = file.channels.get(message.channel_id)
                    if channel is not None and channel.topic in wanted:
                        data = self._type(channel.topic).canonical(message.data)
                        heapq.heappush(waiting, (message.log_time, channel.topic, data))
                while waiting and waiting[0][0] < limit:
                    yield heapq.heappop(waiting)

        for (stamp, topic), group in groupby(in_order(), key=itemgetter(0, 1)):
            yield stamp, topic, [data for _, _, data in group]

    def restarts(self, topics: Sequence[str]) -> dict[str, set[int]]:
        """Stamps (ns), by topic, of messages with which a publisher began to count anew: started again."""
        found: dict[str, set[int]] = {topic: set() for topic in topics}
        heard: set[str] = set()
        for file in self._files:
            names = {id: channel.topic for id, channel in file.channels.items() if channel.topic in found}
            for message in file.messages(names.keys()):
                topic = names[message.channel_id]
                if message.sequence == 1 and topic in heard:
                    found[topic].add(message.log_time)
                heard.add(topic)
        return found

    def definition(self, topic: str) -> tuple[Schema | None, Channel]:
        """MCAP schema and channel record of a topic, from the first file that has it."""
        self._known([topic])
        return self._definitions[topic]

    def check_type(self, topic: str) -> None:
        """Raise ConfigurationError when a topic's messages are not laid out as the installed type is."""
        kind = self._type(topic)
        if not kind.is_laid_out_as(installed_type(kind.name)):
            raise ConfigurationError(
                f"{self.path}: topic {topic} was recorded with other fields in {kind.name} than are installed"
            )

    def _known(self, topics: Sequence[str] | None) -> set[str]:
        unknown = set(topics or ()) - self.topics.keys()
        if unknown:
            has = ", ".join(sorted(self.topics)) or "none"
            raise ConfigurationError(f"{self.path}: has no topic {', '.join(sorted(unknown))}; it has {has}")
        return set(self.topics if topics is None else topics)

    def _type(self, topic: str) -> MessageType:
        if topic not in self._types:
            schema, channel = self.definition(topic)
            if schema is None or channel.message_encoding != "cdr":
                raise ConfigurationError(f"{self.path}: topic {topic} has no message definition, or is not CDR")
            self._types[topic] = MessageType(schema.name, schema.data, schema.encoding)
        return self._types[topic]


def identical(first: Bag, second: Bag, topics: Sequence[str]) -> list[Difference]:
    """Compare two bags message by message, bit for bit, and give the first difference of each topic.

    Messages are compared in order of stamp, all bytes but those between the fields: ROS leaves there what the
    memory held. So runs in which processes only answered in another order are identical, which an empty list
    says.
    Raises ConfigurationError when neither bag has one of the topics.
    """
    differences: dict[str, Difference] = {}
    for topic in topics:
        if topic not in first.topics and topic not in second.topics:
            raise ConfigurationError(f"topic {topic}: in neither {first.path} nor {second.path}")

    def note(topic: str, stamp: int, field: str, one: Any, other: Any) -> None:
        differences.setdefault(topic, Difference(topic, stamp, field, one, other))

    for stamp, topic, ones, others in _side_by_side(first, second, topics):
        if ones != others and topic not in differences:
            one, other = next(pair for pair in zip_longest(ones, others) if pair[0] != pair[1])
            if one is None or other is None:
                note(topic, stamp, "", one, other)
            else:
                note(topic, stamp, *_field_difference(first._type(topic), one, second._type(topic), other))
        if len(differences) == len(set(topics)):
            break
    return [differences[topic] for topic in topics if topic in differences]


def _side_by_side(
    first: Bag, second: Bag, topics: Sequence[str]
) -> Iterator[tuple[int, str, list[bytes], list[bytes]]]:
    """Both bags' messages by stamp and topic, an empty list where a bag has none."""

    def tagged(side: int, bag: Bag) -> Iterator[tuple[int, str, int, list[bytes]]]:
        for stamp, topic, data in bag.by_stamp([topic for topic in topics if topic in bag.topics]):
            yield stamp, topic, side, data

    merged = heapq.merge(tagged(0, first), tagged(1, second))
    for (stamp, topic), group in groupby(merged, key=itemgetter(0, 1)):
        sides: dict[int, list[bytes]] = {side: data for _, _, side, data in group}
        yield stamp, topic, sides.get(0, []), sides.get(1, [])


def _field_difference(kind: MessageType, one: bytes, other_kind: MessageType, other: bytes) -> tuple[str, Any, Any]:
    """Name of the first field in which two messages differ, and both values."""
    fields, other_fields = kind.arrays([one]), other_kind.arrays([other])
    for field in fields | other_fields:
        values = [side[field][0] if field in side else None for side in (fields, other_fields)]
        if np.asarray(values[0]).tobytes() != np.asarray(values[1]).tobytes():
            return field, values[0], values[1]
    return "encapsulation", one[:4], other[:4]


def read(path: str | Path) -> dict[str, "pd.DataFrame"]:
    """All topics of a bag as pandas frames by topic, indexed by time in s, a column per element of an array.

    Raises ConfigurationError when the bag cannot be read or pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise ConfigurationError("pandas is not installed: pip install pandas") from None
    bag = Bag(path)
    return {topic: pd.DataFrame(columns(bag.arrays(topic))).set_index("time") for topic in bag.topics}


def columns(arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Flatten stacked arrays to one column an element, "force" of shape (n, 3) to "force.0" to "force.2"."""
    flat = {}
    for field, array in arrays.items():
        if array.ndim == 1:
            flat[field] = array
        else:
            for index in range(array.shape[1]):
                flat[f"{field}.{index}"] = array[:, index]
    return flat
