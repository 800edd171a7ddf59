"""Consistency of the filter with its readings."""

from collections import deque
from collections.abc import Callable
from enum import Enum
from functools import cache

from scipy.special import chdtri

WINDOW = 20
"""Updates over which normalised innovations squared (NIS) are summed."""

FALSE_ALARM = 1e-7
"""Probability that one window of a consistent filter counts as divergence."""

INFLATION = 10.0
"""Factor on the covariance at each update at which the gates reject most readings."""

UPDATES_TO_DIVERGE = 5
"""Consecutive updates at which the gates reject most readings, from which on the covariance is inflated."""

INFLATIONS = 6
"""Consecutive inflations after which the state is lost: a thousand times the standard deviation did not help."""


class Verdict(Enum):
    """Consequence of an update."""

    CONSISTENT = "consistent"
    INFLATE = "inflate"
    GIVE_UP = "give up"


class Consistency:
    """Detects divergence: gates that reject most readings, or a sum of NIS beyond chi-square."""

    def __init__(self) -> None:
        """Without a history."""
        self._nis: deque[float] = deque(maxlen=WINDOW)
        self._freedom: deque[int] = deque(maxlen=WINDOW)
        self._rejected = self._inflations = 0

    def judge(
        self,
        nis: float,
        used: int,
        rejected: int,
        explains_excess: Callable[[], bool],
        are_white: Callable[[], bool],
    ) -> tuple[Verdict, float]:
        """Judge an update.

        Args:
            nis: normalised innovation squared of the values used.
            used: number of these, the degrees of freedom of their NIS.
            rejected: number of values rejected by the gates.
            explains_excess: whether noisier sensors explain a NIS that is too large.
            are_white: whether the rejected readings are noise or outliers, since they are not alike.

        Returns:
            The verdict, and the factor by which to inflate the covariance.
        """
        if rejected > used:
            self._rejected += 1
            if self._rejected < UPDATES_TO_DIVERGE or are_white():
                return Verdict.CONSISTENT, 1.0
            self._inflations += 1
            return (Verdict.GIVE_UP if self._inflations > INFLATIONS else Verdict.INFLATE), INFLATION
        if not used:  # all were compared only
            return Verdict.CONSISTENT, 1.0
        self._rejected = self._inflations = 0
        self._nis.append(nis)
        self._freedom.append(used)
        total, freedom = sum(self._nis), sum(self._freedom)
        if len(self._nis) < WINDOW or total <= _largest_nis(freedom):
            return Verdict.CONSISTENT, 1.0
        self._nis.clear()
        self._freedom.clear()
        if explains_excess():
            return Verdict.CONSISTENT, 1.0
        return Verdict.INFLATE, total / freedom


@cache
def _largest_nis(freedom: int) -> float:
    return float(chdtri(freedom, FALSE_ALARM))
