"""Records an in-process run as the recorder node would record the node graph."""

from collections.abc import Callable
from typing import Any

from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.messages.conversion import received, to_cdr, type_name
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.recording.writer import BagWriter


class InProcessRecorder:
    """A sink for :class:`formation_gnc.sil.runner.Run` that writes every record to a bag."""

    def __init__(self, bag: BagWriter) -> None:
        """Write to a bag, which is closed by the one who made it."""
        self._bag = bag
        self._counts: dict[str, int] = {}

    def __call__(self, topic: str, record: Any) -> None:
        """Write one record."""
        if topic not in self._counts:
            self._bag.add_topic(topic, type_name(type(record)), topics.QUEUE_DEPTH)
        self._append(topic, to_cdr(record), record.time)

    def copy(self, source: Bag, topic: str, data: bytes, time: int) -> None:
        """Write a message of another bag as it is."""
        if topic not in self._counts:
            self._bag.add_defined_topic(topic, TopicDefinition.recorded(*source.definition(topic)))
        self._append(topic, data, time)

    def _append(self, topic: str, data: bytes, time: int) -> None:
        self._counts[topic] = number = self._counts.get(topic, 0) + 1
        self._bag.write(topic, data, time, number)


_RECORDS = {type_name(each.record): each.record for each in (*topics.RUN_TOPICS, *topics.DEPUTY_TOPICS) if each.record}
"""Records of topics by type of message."""


def reader(bag: Bag) -> Callable[[str, bytes], Any]:
    """A function that gives the record which a message of the bag carries, by its topic and CDR bytes.

    It gives None for one that a node would not have taken either: its values are out of their bounds. It raises
    ConfigurationError for a topic whose messages are not laid out as the installed type is.
    """

    known: dict[str, Callable[[bytes], Any]] = {}

    def read(topic: str, data: bytes) -> Any:
        decode = known.get(topic)
        if decode is None:
            bag.check_type(topic)
            kind = bag.topics[topic].type_name
            record = _RECORDS.get(kind) or getattr(records, kind.rpartition("/")[2], None)
            if record is None:
                raise ConfigurationError(f"{bag.path}: topic {topic} has messages of type {kind}")
            decode = known[topic] = received(record)
        try:
            return decode(data)
        except ConfigurationError:
            return None

    return read
