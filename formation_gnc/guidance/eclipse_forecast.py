"""Forecast of the chief's eclipses."""

import math

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.errors import ImpactError
from formation_gnc.orbit.eclipse import eclipses
from formation_gnc.records import NO_ECLIPSES
from formation_gnc.types import NANOSECONDS, Times, Vector

STEPS = 180
"""Points of a revolution at which the chief is checked for eclipses."""


class EclipseForecast:
    """The chief's current eclipse and those within its next revolution at least.

    Once a revolution the chief's estimated orbit is propagated two revolutions ahead.
    """

    def __init__(self) -> None:
        """Without a forecast yet."""
        self._intervals: Times = NO_ECLIPSES
        self._renewal = 0
        """Time of the next propagation, ns."""

    def intervals(self, time: int, chief_state: Vector, common: CommonParameters) -> Times:
        """(N, 2) begin and end, ns, of the eclipses that are not over.

        The forecast is kept when the chief's state gives no orbit, and renewed after one more step.

        Args:
            time: now, ns.
            chief_state: (6,) estimated inertial state of the chief, m and m/s.
            common: parameters of the run.
        """
        if time >= self._renewal:
            seconds = time / NANOSECONDS
            wait = revolution = math.tau / common.mean_motion
            try:
                ahead = eclipses(chief_state, 2.0 * revolution, revolution / STEPS, common.epoch + seconds)
                self._intervals = time + np.rint(ahead * NANOSECONDS).astype(np.int64)
            except ImpactError:  # raised for a state that is not finite too
                wait /= STEPS
            self._renewal = time + round(wait * NANOSECONDS)
        while len(self._intervals) and self._intervals[0, 1] <= time:
            self._intervals = self._intervals[1:]
        return self._intervals
