"""Reading bags: raw messages in bounded memory, decoded messages, and whole topics as NumPy arrays."""

import heapq
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.flight import topics as run_topics
from formation_gnc.recording.completeness import gaps, tick_of
from formation_gnc.recording.contents import BagContents, own_type, unread_reason
from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.recording.fields import Arrays, Fields
from formation_gnc.recording.order import RunOrder, pacing_topic
from formation_gnc.recording.provenance import IGNORED, LOST
from formation_gnc.recording.stored_file import OWN_PACKAGE, BagMessage, type_of

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Topic:
    """A topic of a bag: its message type and its number of messages."""

    name: str
    type_name: str
    count: int


class Bag:
    """A recorded bag: a directory of MCAP or sqlite3 files as rosbag2 lays them out, or one such file.

    Stamps are simulated time, ns: those in the headers of messages. Messages of the project that were recorded
    twice count once, and those of each topic come in order of stamp.

    Attributes:
        path: name of the bag, of a run of it with the run's number; `source` is where it is.
        topics: by name.
        metadata: MCAP metadata records by name, the provenance of the run among them.
        attachments: files carried in the bag, by name.
        start_ns, end_ns: first and last stamp; 0 and 0 when empty.
        tick_ns: time between ticks, ns; 0 when it is not known.
        damage: None, or the reason why the bag ends early, when its recorder could not finish it; everything
            before is read as usual.
        lost: number of messages that the recorder knows to have missed.
        remarks: what is damaged, missing, left out, doubled or out of order, one line each.

    Raises:
        BagError: here or while reading, when the path is missing, holds no bag, or is damaged.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a bag by its directory or file."""
        self.path = self.source = Path(path)
        self._contents = contents = BagContents(self.path)
        self.metadata, self.attachments, self.damage = contents.metadata, contents.attachments, contents.damage
        counts = self.metadata.get(LOST, {})
        self.lost = sum(int(count) for count in counts.values() if _is_count(count))
        self._unread_counts = [f"{topic} ({count[:20]!r})" for topic, count in counts.items() if not _is_count(count)]
        self._error: BagError | None = None
        self._orders: list[RunOrder] = []
        try:
            self._orders = contents.orders
        except BagError as error:
            self._error = error
        self._select(self._orders[0] if len(self._orders) == 1 else None)

    def _select(self, run: RunOrder | None) -> None:
        """Read the rows of one run; None for all as they are."""
        contents = self._contents
        self._rows: dict[str, NDArray[np.int64]] = dict(run.rows) if run else {}
        self.topics = {
            name: Topic(name, series.type_name, len(self._rows[name]) if name in self._rows else contents.count(name))
            for name, series in contents.series.items()
        }
        own = [name for name, series in contents.series.items() if series.is_own and self.topics[name].count]
        spans = [(int(each.min()), int(each.max())) for each in map(self.stamps, own or self._filled)]
        self.start_ns = min((first for first, _ in spans), default=0)
        self.end_ns = max((last for _, last in spans), default=0)
        counts = {name: self.topics[name].count for name in own}
        pace = pacing_topic(counts)
        self.tick_ns = tick_of(self.metadata, self.stamps(pace)) if pace else 0
        self._run_remarks = [*(run.remarks if run else ()), *gaps(counts, self.stamps, self.tick_ns)]

    @property
    def _filled(self) -> list[str]:
        return [name for name, topic in self.topics.items() if topic.count]

    @property
    def remarks(self) -> list[str]:
        """What is damaged, missing, left out, doubled or out of order, one line each."""
        lines = [*self._contents.remarks]
        if len(self._orders) > 1:
            lines.append(f"{len(self._orders)} runs are in it, one after the other")
        if self._error is not None:
            lines.append(str(self._error))
        if self._unread_counts:
            lines.append(f"how many messages were lost is not known of {', '.join(self._unread_counts[:5])}")
        ignored = self.metadata.get(IGNORED, {})
        if ignored:
            named = ", ".join(f"{count} of {topic}" for topic, count in ignored.items())
            lines.append(f"left out when it was recorded, as messages of other publishers: {named}")
        return [*lines, *self._run_remarks]

    @property
    def are_told_apart(self) -> bool:
        """Whether runs, where there are several, can be separated."""
        return self._error is None

    def runs(self) -> "list[Bag]":
        """The runs in the bag, one after the other; usually one, the bag itself.

        Raises:
            BagError: runs that are mixed and cannot be told apart.
        """
        if self._error is not None:
            raise self._error
        if len(self._orders) < 2:
            return [self]
        runs = []
        for number, order in enumerate(self._orders, 1):
            run = copy(self)
            run.path = self.path.with_name(f"{self.path.name} run {number}")
            run._orders = [order]
            run._select(order)
            runs.append(run)
        return runs

    def check_own_types(self) -> None:
        """Raise BagError for a topic by a name of the run's that is of another type."""
        own = [name for name, topic in self.topics.items() if topic.type_name.startswith(OWN_PACKAGE)]
        spaces = {"", *map(run_topics.deputy_of, own)}
        for name, topic in self.topics.items():
            expected = own_type(name)
            if topic.count and expected and run_topics.deputy_of(name) in spaces and topic.type_name != expected:
                has = topic.type_name or "unknown"
                raise BagError(f"{self.path}: topic {name} is of another type, {has}; it must be {expected}")

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Stamps (ns) of a topic, in order unless the bag has several runs."""
        stamps = self._contents.stamps(topic)
        return stamps[self._rows[topic]] if topic in self._rows else stamps

    def unread_reason(self, topic: str) -> str:
        """Why messages of a topic cannot be decoded; empty when they can."""
        return unread_reason(self._contents.series[topic])

    def messages(
        self, topics: Sequence[str] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[tuple[str, bytes, int]]:
        """Messages as (topic, CDR bytes, stamp in ns), in recorded order.

        Args:
            topics: None for all.
            start_ns: first stamp.
            end_ns: stamp before which to end.
        """
        for message in self._messages(self._known(topics), start_ns, end_ns):
            yield message.topic, message.data, message.stamp

    def _messages(self, wanted: Collection[str], start_ns: int = 0, end_ns: int = 2**64) -> Iterator[BagMessage]:
        ranks = {topic: self._rank(topic) for topic in wanted if topic in self._rows}
        for number, span in self._contents.spans():
            if span.end >= start_ns and span.start < end_ns:
                for message in self._contents.span_messages(number, span, wanted):
                    rank = ranks.get(message.topic)
                    if start_ns <= message.stamp < end_ns and (rank is None or rank[message.row] >= 0):
                        yield message

    def _rank(self, topic: str) -> NDArray[np.int64]:
        """Place of each row in order of stamp; -1 for one that is left out."""
        rank = np.full(self._contents.count(topic), -1, dtype=np.int64)
        rank[self._rows[topic]] = np.arange(len(self._rows[topic]))
        return rank

    def decoded(
        self, topics: Sequence[str] | None = None, start_ns: int = 0, end_ns: int = 2**64
    ) -> Iterator[tuple[str, Any, int]]:
        """Messages as (topic, message with its fields as attributes, stamp in ns)."""
        for topic, data, stamp in self.messages(topics, start_ns, end_ns):
            yield topic, self.message_type(topic).message(data), stamp

    def arrays(self, topic: str, fields: Collection[str] | None = None) -> Fields:
        """All messages of a topic: an array per field, a row per message in order of stamp.

        "stamp_ns" is the stamp (int64, ns), "time" the same in s; then the fields of the message as in
        `MessageType.arrays`.

        Args:
            topic: full name.
            fields: of the message, with what is nested in them; None for all.
        """
        return self._as_arrays(topic, self._in_order(topic, list(self._messages(self._known([topic])))), fields)

    def _in_order(self, topic: str, messages: list[BagMessage]) -> list[BagMessage]:
        if self._is_in_order(topic):
            return messages
        rank = self._rank(topic)
        return sorted(messages, key=lambda message: int(rank[message.row]))

    def _is_in_order(self, topic: str) -> bool:
        return topic not in self._rows or bool(np.all(np.diff(self._rows[topic]) > 0))

    def batches(
        self, topics: Sequence[str], size: int = 1024, fields: Mapping[str, Collection[str]] | None = None
    ) -> Iterator[tuple[str, Fields]]:
        """Messages as (topic, `arrays` of some of them) in one pass, for bags of any length.

        Those of each topic come in order of stamp; one that was recorded out of order is held in memory.

        Args:
            topics: full names.
            size: most messages of a batch.
            fields: of the messages by topic, as for `arrays`; all of a topic without an entry.
        """
        wanted = fields or {}
        waiting: dict[str, list[BagMessage]] = {topic: [] for topic in topics}
        streamed = {topic for topic in topics if self._is_in_order(topic)}
        for message in self._messages(self._known(topics)):
            topic = message.topic
            rows = waiting[topic]
            rows.append(message)
            if len(rows) == size and topic in streamed:
                waiting[topic] = []
                yield topic, self._as_arrays(topic, rows, wanted.get(topic))
        for topic, rows in waiting.items():
            ordered = self._in_order(topic, rows)
            for start in range(0, len(rows), size):
                yield topic, self._as_arrays(topic, ordered[start : start + size], wanted.get(topic))

    def _as_arrays(self, topic: str, rows: list[BagMessage], fields: Collection[str] | None) -> Fields:
        beyond = any(row.stamp >= 2**63 for row in rows)
        stamps = np.array([row.stamp for row in rows], dtype=np.uint64 if beyond else np.int64)
        arrays = self.message_type(topic).arrays([row.data for row in rows], fields)
        return Fields(f"{self.path}: topic {topic}", {"stamp_ns": stamps, "time": stamps * 1e-9, **arrays})

    def by_stamp(self, topics: Sequence[str]) -> Iterator[tuple[int, str, list[bytes]]]:
        """Canonical messages by (stamp, topic), sorted, also among those of one stamp and topic.

        Independent of the order in which processes answered. Messages that cannot be decoded come as they are.
        Holds in memory only messages that a later chunk may still precede.
        """
        wanted = self._known(topics)
        kinds = {topic: None if self.unread_reason(topic) else self.message_type(topic) for topic in wanted}
        ranks = {topic: self._rank(topic) for topic in wanted if topic in self._rows}
        spans = self._contents.spans()
        settled = [2**64]  # by span: every later message has at least this stamp
        for _, span in reversed(spans[1:]):
            settled.append(min(settled[-1], span.start))
        waiting: list[tuple[int, str, bytes]] = []

        def in_order() -> Iterator[tuple[int, str, bytes]]:
            for (number, span), limit in zip(spans, reversed(settled), strict=False):
                for topic, row, stamp, data, _ in self._contents.span_messages(number, span, wanted):
                    if topic not in ranks or ranks[topic][row] >= 0:
                        kind = kinds[topic]
                        heapq.heappush(waiting, (stamp, topic, kind.canonical(data) if kind else data))
                while waiting and waiting[0][0] < limit:
                    yield heapq.heappop(waiting)

        for (stamp, topic), group in groupby(in_order(), key=itemgetter(0, 1)):
            yield stamp, topic, [data for _, _, data in group]

    def restarts(
        self, topics: Sequence[str], publisher: Callable[[str, bytes], str] = lambda topic, data: topic
    ) -> dict[str, set[int]]:
        """Stamps (ns) of messages with which a publisher (of topic and CDR bytes) restarted its count, by its name."""
        found: dict[str, set[int]] = {topic: set() for topic in topics}
        heard: set[str] = set()
        for message in self._messages([topic for topic in topics if topic in self.topics]):
            name = publisher(message.topic, message.data)
            if message.sequence == 1 and name in heard:
                found.setdefault(name, set()).add(message.stamp)
            heard.add(name)
        return found

    def definition(self, topic: str) -> tuple[Schema | None, Channel]:
        """MCAP schema (None: there is none) and channel record of a topic, from the first file with it."""
        self._known([topic])
        return self._contents.definition(topic)

    def message_type(self, topic: str) -> MessageType:
        """Type of a topic's messages, by the definition in the bag, or the installed one where it has none.

        Raises:
            BagError: it cannot be decoded.
        """
        self._known([topic])
        try:
            return type_of(self._contents.series[topic])
        except BagError as error:
            raise BagError(f"{self.path}: topic {topic}: {error}") from None

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


def _is_count(text: str) -> bool:
    """Whether a text is a number of messages: decimal, within 64 bits."""
    return text.isdecimal() and len(text) < 20
