"""Curves of bounded length from runs of any length."""

import numpy as np
from numpy.typing import NDArray

from formation_gnc.flight import topics
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Matrix

POINTS = 2000
"""Points of a drawn curve; at most twice as many."""

OF_A_FLEET, FEWEST = 8000, 500
"""Points of a curve of every deputy together, and of one at least: the page of a fleet is no weight either."""


def points_of(deputies: int) -> int:
    """Points of a curve in a fleet of so many."""
    return max(FEWEST, min(POINTS, OF_A_FLEET // max(1, deputies)))


class Thinned:
    """Every n-th of the rows added, n doubling such that there are never more than twice `points`."""

    def __init__(self, width: int, points: int) -> None:
        """Start without rows of `width` numbers."""
        self.rows: Matrix = np.empty((0, width))
        self._most = 2 * points
        self._stride, self._seen = 1, 0

    def add(self, rows: Matrix) -> None:
        """Add the next rows, (N, width)."""
        index = np.arange(self._seen, self._seen + len(rows))
        self._seen += len(rows)
        self.rows = np.concatenate((self.rows, rows[index % self._stride == 0]))
        while len(self.rows) > self._most:
            self.rows = self.rows[::2]
            self._stride *= 2


class ThinnedByKey[K]:
    """Thinned rows for each key that occurs."""

    def __init__(self, width: int, points: int) -> None:
        """Start without keys."""
        self._width, self._points = width, points
        self._series: dict[K, Thinned] = {}

    def add(self, key: K, rows: Matrix) -> None:
        """Add the next rows, (N, width), of a key."""
        self._series.setdefault(key, Thinned(self._width, self._points)).add(rows)

    @property
    def rows(self) -> dict[K, Matrix]:
        """Rows by key, in the order in which the keys occurred."""
        return {key: series.rows for key, series in self._series.items()}


class TickSelection:
    """Selects every n-th tick, the same for all topics, such that `points` remain.

    Attributes:
        points: how many.
        tick_ns: time between ticks, ns; 0 for a single tick.
    """

    def __init__(self, bag: Bag, points: int) -> None:
        """Derive n from the number of truths and the tick."""
        self.points = points
        self._start, self.tick_ns = int(bag.stamps(topics.TRUTH.name)[0]), bag.tick_ns
        self._step = max(1, self.tick_ns * -(-bag.topics[topics.TRUTH.name].count // points))

    def __call__(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether each stamp (ns) is selected."""
        selected: NDArray[np.bool_] = (stamps - self._start) % self._step == 0
        return selected
