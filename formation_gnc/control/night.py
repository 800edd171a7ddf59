"""Eclipses as a controller foresees them."""

from math import asin, tau

import numpy as np
from numpy.typing import NDArray

from formation_gnc.interface import NANOSECONDS
from formation_gnc.orbit.constants import EARTH_RADIUS


class Night:
    """When there is no thrust for want of sunlight."""

    def __init__(self, kind: str, share: float, period: float, semi_major_axis: float) -> None:
        """For an orbit with this period, s, and semi-major axis, m.

        `kind` is "none", "share" (the last `share` of every orbit from time zero) or "observed" (where the
        shadow was met last).
        """
        self._kind, self._period_ns = kind, round(period * NANOSECONDS)
        self.longest = {
            "none": 0.0,
            "share": share * period,
            "observed": period * asin(min(1.0, EARTH_RADIUS / semi_major_axis)) / (0.5 * tau),
        }[self._kind]
        self.seen: tuple[int, int] | None = None
        """Begin and end of the last shadow met, ns."""
        self._inside = False

    def watch(self, time: int, eclipse: bool) -> None:
        """Note where the shadow begins and ends."""
        if self._kind != "observed":
            return
        if eclipse and not self._inside:
            length = round(self.longest * NANOSECONDS) if self.seen is None else self.seen[1] - self.seen[0]
            self.seen = time, time + length
        elif self._inside and not eclipse and self.seen is not None:
            self.seen = self.seen[0], time
        self._inside = eclipse

    def dark(self, time: int, step: int, steps: int) -> NDArray[np.bool_]:
        """(steps,) whether any part of each step from a time (ns) is without light."""
        begin = time + step * np.arange(steps)
        if self._kind == "share":
            length = round(self.longest * NANOSECONDS)
            night = self._period_ns - length, self._period_ns
        elif self._kind == "observed" and self.seen is not None:
            night = self.seen
        else:
            return np.zeros(steps, dtype=bool)
        since = (begin - night[0]) % self._period_ns
        result: NDArray[np.bool_] = (since < night[1] - night[0]) | (since + step > self._period_ns)
        return result
