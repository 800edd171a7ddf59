"""Verdict on a recorded run: whether a deputy holds its formation, is on its way to it, has given it up or lost it."""

from dataclasses import dataclass
from enum import StrEnum
from math import inf

import numpy as np

from formation_gnc.mode_records import Mode
from formation_gnc.types import Vector

HELD = 0.5
"""Share of the formation's size within which a deputy is in formation."""

SHRINKING = 0.9
"""Largest ratio of the errors of two windows that follow one another at which the error shrinks."""

SILENCE = 0.1
"""Share of the run at its end without an answer after which a deputy is lost."""


GIVEN_UP = frozenset({Mode.STANDBY, Mode.AVOID, Mode.SAFE})
"""Modes in which a deputy does not follow its target."""


class Verdict(StrEnum):
    """State of a deputy at the end of a run."""

    HELD = "held"
    ACQUIRING = "acquiring"
    GIVEN_UP = "given up"
    LOST = "lost"


@dataclass(frozen=True)
class ErrorHistory:
    """Distance of a deputy from its target over a run.

    Attributes:
        time: (N,) of the ticks that all of its modules answered, s.
        error: (N,) distance from the target, m.
        size: (N,) distance of the target from the chief, m.
        end: of the run, s.
        period: of the chief's orbit, s.
        changed: time of the latest change of the target in flight, s; 0 for none.
        mode: at the end; empty without a supervisor.
    """

    time: Vector
    error: Vector
    size: Vector
    end: float
    period: float
    changed: float = 0.0
    mode: str = ""

    @property
    def _window(self) -> float:
        """Length (s) of the windows compared: an orbit, or half of what there is since the target changed."""
        return min(self.period, (self.end - self.changed) / 2.0)

    def _peak(self, windows_ago: int) -> float:
        """Largest error in a window before the end, m."""
        last = self.end - windows_ago * self._window
        inside = (self.time > last - self._window) & (self.time <= last)
        return float(self.error[inside].max()) if inside.any() else inf

    @property
    def trend(self) -> float:
        """Largest error of the last window over that of the window before; below 1 the error shrinks."""
        before, last = self._peak(1), self._peak(0)
        return last / before if before > 0.0 and np.isfinite(before) else 1.0

    @property
    def verdict(self) -> Verdict:
        """State at the end of the run.

        A deputy that does not answer any more has lost the formation; one that by its mode does not follow its
        target has given it up. Others have an orbit to arrive at a new target. After that they have lost the
        formation when their error exceeds the formation's size and does not shrink.
        """
        if self.end - self.time[-1] > SILENCE * self.end:
            return Verdict.LOST
        if self.mode in GIVEN_UP:
            return Verdict.GIVEN_UP
        size, peak = float(np.sqrt(np.mean(self.size**2))), self._peak(0)
        if peak <= HELD * size:
            return Verdict.HELD
        has_had_time = self.end - self.changed > self.period
        return Verdict.LOST if has_had_time and peak > size and self.trend > SHRINKING else Verdict.ACQUIRING
