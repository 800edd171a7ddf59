"""Whether the filter still agrees with its readings."""

from collections import deque
from enum import Enum
from functools import cache

from scipy.stats import chi2

WINDOW = 20
"""Updates over which the normalised innovations are summed."""

FALSE_ALARM = 1e-7
"""Probability that a consistent filter is called diverged by one window."""

INFLATION = 10.0
"""By which the covariance is multiplied when the gates reject most readings, again and again until they
open."""

UPDATES_TO_DIVERGE = 5
"""Updates in a row in which the gates reject most readings, after which the covariance is inflated."""

INFLATIONS = 6
"""Inflations in a row after which the state is given up: the standard deviation is then a thousand times
what it was."""


class Verdict(Enum):
    """What is to be done."""

    FINE = "fine"
    INFLATE = "inflate"
    GIVE_UP = "give up"


class Consistency:
    """Detects divergence in two ways: readings rejected by the gates, and those taken being too far off in
    sum."""

    def __init__(self) -> None:
        """Without a history."""
        self._nis: deque[float] = deque(maxlen=WINDOW)
        self._freedom: deque[int] = deque(maxlen=WINDOW)
        self._rejected = 0

    def judge(self, nis: float, taken: int, rejected: int) -> tuple[Verdict, float]:
        """After an update.

        Args:
            nis: normalised innovation squared of the readings taken.
            taken: how many these are.
            rejected: how many the gates rejected.

        Returns:
            What is to be done, and by which factor to inflate the covariance.
        """
        if rejected > taken:
            self._rejected += 1
            inflations = self._rejected - UPDATES_TO_DIVERGE
            if inflations < 0:
                return Verdict.FINE, 1.0
            return (Verdict.GIVE_UP if inflations >= INFLATIONS else Verdict.INFLATE), INFLATION
        self._rejected = 0
        self._nis.append(nis)
        self._freedom.append(taken)
        total, freedom = sum(self._nis), sum(self._freedom)
        if len(self._nis) < WINDOW or total <= _bound(freedom):
            return Verdict.FINE, 1.0
        self._nis.clear()
        self._freedom.clear()
        return Verdict.INFLATE, total / freedom


@cache
def _bound(freedom: int) -> float:
    return float(chi2.isf(FALSE_ALARM, freedom))
