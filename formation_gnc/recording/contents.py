"""All messages of a bag's files by topic: which are read, in which order they stand, and what is left out."""

from array import array
from collections.abc import Collection, Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.recording.files import missing_files, open_files
from formation_gnc.recording.order import Recorded, RunOrder, is_free, separate
from formation_gnc.recording.stored_file import OWN_PACKAGE, BagMessage, Series, Span, type_of

_OWN_TYPES = {
    topic.name: (OWN_PACKAGE + "msg/" + topic.record.message if topic.record else topic.message.replace("/", "/msg/"))
    for topic in (topics.CLOCK, topics.TRUTH, topics.EVENTS, *topics.DEPUTY_TOPICS)
}


def own_type(topic: str) -> str:
    """Message type that a run has on a topic of this name; empty for a topic of others."""
    name = topic.rpartition("/")[2] if topics.deputy_of(topic) else topic
    return _OWN_TYPES.get(name, "")


class BagContents:
    """Messages of all files of a bag.

    Attributes:
        series: what is read of each topic.
        metadata, attachments: of all files by name, the last of each.
        damage: None, or the reason why the bag ends early.
        remarks: what is damaged, missing or left out, one line each.

    Raises:
        BagError: the path is missing, holds no bag, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan all files."""
        self.path = path
        self._files = files = open_files(path)
        self.metadata = {name: data for file in files for name, data in file.metadata.items()}
        self.metadata.pop("rosbag2", None)  # rosbag2's own copy of metadata.yaml
        self.attachments = {name: data for file in files for name, data in file.attachments.items()}
        self.damage = next((file.damage for file in files if file.damage), None)
        self.remarks = [*missing_files(path), *(file.damage for file in files if file.damage)]
        self.series: dict[str, Series] = {}
        self._places: dict[str, list[tuple[int, Series, int]]] = {}
        """By topic: number of a file, series in it, and row of its first message."""
        self._counts: dict[str, int] = {}
        for topic, candidates in self._candidates().items():
            self._choose(topic, candidates)
        for topic, (misfits, first) in self._misfits().items():
            self.remarks.append(f"skipped: {misfits} messages of {topic} that do not fit their type, first {first}")
        if orphans := sum(file.orphans for file in files):
            self.remarks.append(f"skipped: {orphans} messages of topics that no file defines")

    def _candidates(self) -> dict[str, dict[Series, int]]:
        """Number of messages of each series, by topic."""
        found: dict[str, dict[Series, int]] = {}
        for file in self._files:
            for series in file.definitions:
                counts = found.setdefault(series.topic, {})
                counts[series] = counts.get(series, 0) + len(file.stamps(series))
        return found

    def _misfits(self) -> dict[str, tuple[int, str]]:
        """Number of messages that cannot be decoded, and where the first one stands, by topic."""
        found: dict[str, tuple[int, str]] = {}
        for file in self._files:
            for series in file.definitions:
                if misfits := file.misfits(series):
                    count, first = found.get(series.topic, (0, file.first_misfit(series)))
                    found[series.topic] = count + misfits, first
        return found

    def _choose(self, topic: str, candidates: dict[Series, int]) -> None:
        """Read the series of the run's type, or else the fullest, with those laid out alike."""
        expected = own_type(topic)
        best = max(
            candidates, key=lambda series: (candidates[series] > 0, series.type_name == expected, candidates[series])
        )
        self.series[topic] = best
        count, places = 0, list[tuple[int, Series, int]]()
        for series, messages in candidates.items():
            if series != best and not _alike(series, best):
                if messages:
                    self.remarks.append(
                        f"skipped: {messages} messages of {topic} of another type, {series.type_name or 'unknown'}"
                        f"{' with other fields' if series.type_name == best.type_name else ''}"
                    )
                continue
            for number, file in enumerate(self._files):
                places.append((number, series, count))
                count += len(file.stamps(series))
        self._counts[topic], self._places[topic] = count, places

    def count(self, topic: str) -> int:
        """Number of a topic's messages."""
        return self._counts[topic]

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Stamps (ns) of a topic by row."""
        parts = [(place, self._files[number].stamps(series)) for number, series, place in self._places[topic]]
        parts.sort(key=lambda part: (part[0], len(part[1])))
        return np.concatenate([stamps for _, stamps in parts])

    def definition(self, topic: str) -> tuple[Schema | None, Channel]:
        """MCAP schema (None: there is none) and channel record of a topic, from the first file with it."""
        series = self.series[topic]
        return next(file.definitions[series] for file in self._files if series in file.definitions)

    def spans(self) -> list[tuple[int, Span]]:
        """Parts of the bag that are read at once, in recorded order, each with the number of its file."""
        return [(number, span) for number, file in enumerate(self._files) for span in file.spans]

    def span_messages(self, number: int, span: Span, wanted: Collection[str]) -> Iterator[BagMessage]:
        """Messages of some topics in a span of a file, in recorded order.

        Raises:
            BagError: the file is damaged.
        """
        file = self._files[number]
        rows = {
            series: row
            for topic in wanted
            for each, series, row in self._places.get(topic, ())
            if each == number and series in span.series
        }
        return file.messages(span, rows) if rows else iter(())

    @cached_property
    def orders(self) -> list[RunOrder]:
        """The runs; none where all messages stand in order, once each, and so are one run.

        Raises:
            BagError: runs that are mixed and cannot be told apart.
        """
        own = [topic for topic, series in self.series.items() if series.is_own and self._counts[topic]]
        if not any(self._is_suspicious(topic) for topic in own):
            return []
        found: dict[str, tuple[array[int], ...]] = {topic: (array("q"), array("q"), array("q")) for topic in own}
        position = 0
        for number, span in self.spans():
            for message in self.span_messages(number, span, own):
                for values, value in zip(
                    found[message.topic], (message.row, position, hash(message.data)), strict=True
                ):
                    values.append(value)
                position += 1
        recorded = {}
        for topic, columns in found.items():
            rows, positions, digests = (np.frombuffer(values, dtype=np.int64) for values in columns)
            recorded[topic] = Recorded(self.stamps(topic)[rows], rows, positions, digests)
        return separate(recorded, str(self.path))

    def _is_suspicious(self, topic: str) -> bool:
        """Whether messages of a topic may be doubled, out of order, or of several runs."""
        if any(self._files[number].repeats(series) for number, series, _ in self._places[topic]):
            return True
        steps = np.diff(self.stamps(topic))
        return bool(np.any(steps < 0) or (not is_free(topic) and np.any(steps == 0)))


def _alike(series: Series, other: Series) -> bool:
    """Whether messages of both are laid out alike."""
    if series.message_encoding != other.message_encoding:
        return False
    try:
        return type_of(series).has_fields_of(type_of(other))
    except BagError:
        return False


def unread_reason(series: Series) -> str:
    """Why messages of a series cannot be decoded; empty when they can."""
    try:
        type_of(series)
    except BagError as error:
        return str(error)
    return ""
