"""Events and eclipses, to be marked on time axes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

_COLOURS = {"miss": "#d62728", "fallback": "#e377c2", "end": "#222222"}
_OTHER_COLOURS = ("#9467bd", "#17becf", "#8c564b", "#bcbd22", "#636efa", "#00a08b", "#b6316c", "#7f7f7f")


@dataclass(frozen=True)
class Mark:
    """An event on a time axis."""

    time: float
    """h."""
    kind: str
    node: str
    subject: str
    detail: str


@dataclass(frozen=True)
class Timeline:
    """What is marked on a time axis."""

    events: Sequence[Mark]
    eclipses: Sequence[Sequence[float]]
    """Begin and end of each, h."""
    colours: Mapping[str, str]
    """By kind of event."""


def event_colours(kinds: Iterable[str]) -> dict[str, str]:
    """A colour for every kind of event of a run."""
    return _COLOURS | dict(zip((kind for kind in sorted(kinds) if kind not in _COLOURS), cycle(_OTHER_COLOURS)))
