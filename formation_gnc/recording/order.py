"""Runs of a bag, each in order of stamp: what was recorded twice, out of order, or of several runs on end."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import BagError
from formation_gnc.flight import topics
from formation_gnc.types import NANOSECONDS

Rows = NDArray[np.int64]

PIECES = 3
"""Pieces out of order that a run has on average at most, where a bag has several: more, and they are interleaved."""

_FREE = {topics.EVENTS.name, topics.TIMING.name}
"""Names of topics of several publishers, whose stamps may repeat and go back."""


_NOISY = {topics.MEASUREMENT.name, topics.ESTIMATE.name}
"""Names of a deputy's topics that a run's seed decides."""


@dataclass(frozen=True)
class Recorded:
    """Messages of a topic in recorded order."""

    stamps: NDArray[np.int64]
    """ns."""
    rows: Rows
    """Places among the topic's messages."""
    positions: NDArray[np.int64]
    """Places among all messages of the bag."""
    contents: NDArray[np.int64]
    """Digests of the bytes."""


@dataclass
class RunOrder:
    """Rows of a run by topic, in order of stamp, and what was found on the way."""

    rows: dict[str, Rows] = field(default_factory=dict)
    twice: dict[str, int] = field(default_factory=dict)
    """Messages left out, being equal to one before them, by topic."""
    ambiguous: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Stamps with different messages by topic: how many, and the first, ns."""
    backward: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Topics out of order: the first stamp that follows a later one, and that one, ns."""

    @property
    def remarks(self) -> list[str]:
        """What was found, one line each."""
        lines = []
        if self.twice:
            names = ", ".join(sorted(self.twice))
            lines.append(f"recorded twice: {sum(self.twice.values())} messages of {names}; each counts once")
        for topic, (late, after) in sorted(self.backward.items()):
            lines.append(f"{topic}: {_s(late)} stands after {_s(after)}; sorted by stamp")
        for topic, (count, first) in sorted(self.ambiguous.items()):
            lines.append(f"{topic}: different messages of one stamp at {count} ticks, the first at {_s(first)}")
        return lines


def is_free(topic: str) -> bool:
    """Whether several messages of one stamp, and stamps that go back, are usual on a topic."""
    return topic in _FREE or topic.rpartition("/")[2] in _FREE


def pacing_topic(counts: Mapping[str, int]) -> str:
    """Topic by which runs are separated, of those with messages: the truth, else the fullest that is not the clock."""
    usable = {topic: n for topic, n in counts.items() if n and not is_free(topic) and topic != topics.CLOCK.name}
    if topics.TRUTH.name in usable:
        return topics.TRUTH.name
    return max(usable, key=lambda topic: (usable[topic], topic), default="")


def separate(recorded: Mapping[str, Recorded], path: str) -> list[RunOrder]:
    """Rows of every run.

    A run has one message of the pacing topic at a stamp. Where stamps go back, what follows belongs to the run
    before, out of order or as a copy, unless it contradicts it.

    Args:
        recorded: the project's topics by name.
        path: of the bag, for errors.

    Raises:
        BagError: runs that are interleaved and cannot be told apart.
    """
    pace = pacing_topic({topic: len(each.stamps) for topic, each in recorded.items()})
    starts = _starts(recorded[pace], pace, path) if pace else [0]
    if len(starts) == 1 and pace and np.any(np.diff(recorded[pace].stamps) < 0):
        starts = _starts_of_noise(recorded, path) or starts
    runs = []
    for number, start in enumerate(starts):
        run = RunOrder()
        for topic, each in recorded.items():
            first = _boundary(each, start, starts[number - 1] if number else 0, _end(starts, number + 1))
            last = _boundary(each, _end(starts, number + 1), start, _end(starts, number + 2))
            _order(run, topic, each, slice(first if number else 0, last))
        runs.append(run)
    return runs


def _end(starts: Sequence[int], number: int) -> int:
    return starts[number] if number < len(starts) else np.iinfo(np.int64).max


def _starts(pacing: Recorded, topic: str, path: str) -> list[int]:
    """Positions at which a run begins on the pacing topic."""
    edges = [0, *(np.flatnonzero(np.diff(pacing.stamps) < 0) + 1).tolist(), len(pacing.stamps)]
    starts, known = [0], dict[int, int]()
    conflict = 0
    for begin, end in pairwise(edges):
        piece: dict[int, int] = {}
        for stamp, content in zip(pacing.stamps[begin:end].tolist(), pacing.contents[begin:end].tolist(), strict=True):
            if piece.setdefault(stamp, content) != content:
                raise _interleaved(path, topic, stamp)
        if any(known.get(stamp, content) != content for stamp, content in piece.items()):
            conflict = next(stamp for stamp, content in piece.items() if known.get(stamp, content) != content)
            starts.append(int(pacing.positions[begin]))
            known = {}
        known |= piece
    if len(starts) > 1 and len(edges) - 1 > PIECES * len(starts):
        raise _interleaved(path, topic, conflict)
    return starts


def _starts_of_noise(recorded: Mapping[str, Recorded], path: str) -> list[int]:
    """Positions at which runs begin whose truth is the same, as of flights that differ in their seed and only coast."""
    for topic in sorted(recorded, key=lambda name: (not name.endswith(f"/{topics.MEASUREMENT.name}"), name)):
        if topic.rpartition("/")[2] not in _NOISY:
            continue
        with suppress(BagError):  # these may be mixed where the truth is not
            starts = _starts(recorded[topic], topic, path)
            if len(starts) > 1:
                return starts
    return []


def _interleaved(path: str, topic: str, stamp: int) -> BagError:
    return BagError(
        f"{path}: several runs are mixed in it and cannot be told apart: {topic} has different messages of {_s(stamp)}"
    )


def _boundary(each: Recorded, start: int, before: int, after: int) -> int:
    """Row at which a topic goes over to the run that begins at a position on the pacing topic.

    Topics lag each other: it is where the stamp falls most between the middles of both runs.
    """
    if start > each.positions[-1:].sum():
        return len(each.stamps)
    lowest = (before + start) // 2
    highest = (start + min(after, int(each.positions[-1]) + 1)) // 2
    inside = np.flatnonzero((each.positions[1:] > lowest) & (each.positions[1:] <= max(highest, start)))
    drops = np.diff(each.stamps)[inside] if len(inside) else np.zeros(0)
    if len(drops) and drops.min() < 0:
        return int(inside[drops.argmin()]) + 1
    return int(np.searchsorted(each.positions, start))


def _order(run: RunOrder, topic: str, each: Recorded, part: slice) -> None:
    """Add a topic to a run: rows by stamp, each message once."""
    rows, stamps = each.rows[part], each.stamps[part]
    if len(rows):
        keys = np.stack((stamps.astype(np.int64), each.contents[part]))
        _, first = np.unique(keys, axis=1, return_index=True)
        kept = np.sort(first)
        if len(kept) < len(rows):
            run.twice[topic] = len(rows) - len(kept)
        rows, stamps = rows[kept], stamps[kept]
    falls = np.flatnonzero(np.diff(stamps) < 0)
    if len(falls) and not is_free(topic):
        run.backward[topic] = int(stamps[falls[0] + 1]), int(stamps[falls[0]])
    order = np.argsort(stamps, kind="stable")
    rows, stamps = rows[order], stamps[order]
    if not is_free(topic):
        same = np.flatnonzero(np.diff(stamps) == 0)
        if len(same):
            run.ambiguous[topic] = len(np.unique(stamps[same])), int(stamps[same[0]])
    run.rows[topic] = rows


def _s(stamp: int) -> str:
    return f"{stamp / NANOSECONDS:g} s"
