"""Two-sided cumulative sums of normalised samples (Page 1954)."""

from math import copysign, isfinite

LARGEST = 3.0
"""Samples are cut to so many standard deviations, so that outliers to either side raise no alarm: at 5 % of all
readings, a chance of 1e-3 in three orbits (with five deviations it would be 0.4)."""

CEILING = 2.0
"""Largest sum, over the threshold, so that it comes down again when the fault is over."""


class Cusum:
    """Two-sided CUSUM of samples that are N(0, 1) without a fault."""

    __slots__ = ("_ceiling", "_down", "_reference", "_up")

    def __init__(self, reference: float, threshold: float) -> None:
        """Half the smallest shift to be found, and the threshold, which the caller compares with."""
        self._reference, self._ceiling = reference, CEILING * threshold
        self._up = self._down = 0.0

    def add(self, sample: float) -> float:
        """Add a sample, and return the larger sum; one that is not finite counts as no sample."""
        if isfinite(sample):
            if not -LARGEST <= sample <= LARGEST:
                sample = copysign(LARGEST, sample)
            up, down = self._up + sample - self._reference, self._down - sample - self._reference
            self._up = 0.0 if up < 0.0 else up if up < self._ceiling else self._ceiling
            self._down = 0.0 if down < 0.0 else down if down < self._ceiling else self._ceiling
        return self._up if self._up > self._down else self._down
