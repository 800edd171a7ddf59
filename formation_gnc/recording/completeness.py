"""Ticks that a run's topics lack."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from formation_gnc.flight import topics
from formation_gnc.parameters import from_json
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.types import NANOSECONDS

PLACES = 3
"""Gaps of a topic that are named."""

Stamps = NDArray[np.int64]

ANSWERS = [
    topic for topic in topics.DEPUTY_TOPICS if topic.every_tick and topic not in (topics.MEASUREMENT, topics.TIMING)
]
"""Topics by which a deputy's modules answer a tick."""


def tick_of(metadata: Mapping[str, Mapping[str, str]], stamps: Stamps) -> int:
    """Tick (ns) of a run: the scenario's, or without that the most frequent step of a topic's stamps; 0 for none.

    Args:
        metadata: of the bag.
        stamps: (N,) ns, sorted, of a topic with a message at every tick.
    """
    steps = np.diff(np.unique(stamps)).astype(np.int64)
    try:
        tick = round(float(from_json(metadata[parameters_record("/plant")]["tick"])) * NANOSECONDS)
    except (KeyError, ValueError, TypeError, OverflowError):
        tick = 0
    if tick > 0 and not np.any(steps % tick):
        return tick
    values, counts = np.unique(steps, return_counts=True)
    return int(values[counts.argmax()]) if len(values) else 0


def gaps(names: Mapping[str, int], stamps_of: Callable[[str], Stamps], tick: int) -> list[str]:
    """A line for a run that begins late, and for each topic that lacks ticks between its first and its last.

    Every run begins at 0. What answers the plant may begin late, once its filter has a fix, and its last tick may be
    under way.

    Args:
        names: number of messages by topic.
        stamps_of: stamps (ns) of a topic, sorted.
        tick: ns; 0 when it is not known.
    """
    deputies = topics.deputies_in(list(names))
    by_plant = [topics.TRUTH.name, topics.CLOCK.name, *(topics.MEASUREMENT.of(deputy) for deputy in deputies)]
    answers = [topic.of(deputy) for deputy in deputies for topic in ANSWERS]
    present = {name: np.unique(stamps_of(name)) for name in (*by_plant, *answers) if names.get(name)}
    ends = [present[name][[0, -1]] for name in by_plant if name in present]
    if not ends or tick <= 0:
        return []
    start, end = min(int(first) for first, _ in ends), max(int(last) for _, last in ends)
    lines = [f"begins at {start / NANOSECONDS:g} s: the run before that is not in it"] if start >= tick else []
    for name, stamps in present.items():
        own = name in by_plant
        places = _places(stamps, start if own else int(stamps[0]), end if own else end - tick, tick)
        if places:
            lines.append(_line(name, places, (end - start) // tick + 1))
    return lines


def _places(stamps: Stamps, start: int, end: int, tick: int) -> list[tuple[int, int, int]]:
    """First and last missing stamp of each gap, ns, and its number of ticks."""
    edges = np.concatenate(([start - tick], stamps, [max(end, int(stamps[-1])) + tick]))
    missing = np.rint(np.diff(edges) / tick).astype(np.int64) - 1
    return [
        (int(edges[row]) + tick, int(edges[row]) + tick * int(missing[row]), int(missing[row]))
        for row in np.flatnonzero(missing > 0)
    ]


def _line(name: str, places: list[tuple[int, int, int]], ticks: int) -> str:
    count = sum(each for _, _, each in places)
    named = [
        f"{first / NANOSECONDS:g} s" if first == last else f"{first / NANOSECONDS:g} to {last / NANOSECONDS:g} s"
        for first, last, _ in places[:PLACES]
    ]
    more = f" and {len(places) - PLACES} more gaps" if len(places) > PLACES else ""
    return f"{name}: {count} of {ticks} ticks are missing, at {', '.join(named)}{more}"
