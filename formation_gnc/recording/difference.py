"""Bit-for-bit comparison of two bags."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from operator import itemgetter
from typing import Any

import numpy as np

from formation_gnc.errors import BagError
from formation_gnc.recording.decode import MessageType
from formation_gnc.recording.reader import Bag


@dataclass(frozen=True)
class Difference:
    """First difference of two bags on a topic."""

    topic: str
    stamp_ns: int
    field: str
    """Name of the field; empty where one bag lacks the message."""
    first: Any
    """Value in the first bag; None where it lacks the message."""
    second: Any
    """Value in the second bag; None where it lacks the message."""

    def __str__(self) -> str:
        """One line for people."""
        place = f"{self.topic} at {self.stamp_ns / 1e9:.9f} s"
        if not self.field:
            return f"{place}: only in the {'first' if self.second is None else 'second'} bag"
        return f"{place}: {self.field} is {self.first} and {self.second}"


def identical(first: Bag, second: Bag, topics: Sequence[str]) -> list[Difference]:
    """Compare two bags message by message, bit for bit.

    Messages are compared in order of stamp, without the alignment gaps, which ROS leaves uninitialized: two
    runs whose processes only answered in another order are identical.

    Returns:
        The first difference of each topic; empty when the bags are identical.

    Raises:
        BagError: neither bag has one of the topics.
    """
    for topic in topics:
        if topic not in first.topics and topic not in second.topics:
            raise BagError(f"topic {topic}: in neither {first.path} nor {second.path}")
    differences: dict[str, Difference] = {}
    for stamp, topic, ones, others in _side_by_side(first, second, topics):
        if ones != others and topic not in differences:
            one, other = next(pair for pair in zip_longest(ones, others) if pair[0] != pair[1])
            if one is None or other is None:
                differences[topic] = Difference(topic, stamp, "", one, other)
            else:
                kinds = first.message_type(topic), second.message_type(topic)
                differences[topic] = Difference(topic, stamp, *_field_difference(kinds[0], one, kinds[1], other))
        if len(differences) == len(set(topics)):
            break
    return [differences[topic] for topic in topics if topic in differences]


def _side_by_side(
    first: Bag, second: Bag, topics: Sequence[str]
) -> Iterator[tuple[int, str, list[bytes], list[bytes]]]:
    """Messages of both bags by stamp and topic; an empty list where a bag has none."""

    def tagged(side: int, bag: Bag) -> Iterator[tuple[int, str, int, list[bytes]]]:
        for stamp, topic, data in bag.by_stamp([topic for topic in topics if topic in bag.topics]):
            yield stamp, topic, side, data

    merged = heapq.merge(tagged(0, first), tagged(1, second))
    for (stamp, topic), group in groupby(merged, key=itemgetter(0, 1)):
        sides: dict[int, list[bytes]] = {side: data for _, _, side, data in group}
        yield stamp, topic, sides.get(0, []), sides.get(1, [])


def _field_difference(kind: MessageType, one: bytes, other_kind: MessageType, other: bytes) -> tuple[str, Any, Any]:
    """Name of the first field in which two messages differ, and its values in both."""
    fields, other_fields = kind.arrays([one]), other_kind.arrays([other])
    for field in fields | other_fields:
        values = [side[field][0] if field in side else None for side in (fields, other_fields)]
        if np.asarray(values[0]).tobytes() != np.asarray(values[1]).tobytes():
            return field, values[0], values[1]
    return "encapsulation", one[:4], other[:4]
