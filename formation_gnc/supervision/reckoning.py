"""Dead reckoning: the chief's ephemeris and the estimate against their own propagation."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.records import Estimate, Measurement
from formation_gnc.supervision.kernels import WINDOW, reckon
from formation_gnc.types import NANOSECONDS, Vector

TICKS, INTERVAL = 10, 120.0
"""Ticks between comparisons, and the longest time in between, s, of which there is at least a tick."""

_NO_STATE, _NO_COVARIANCE = np.zeros(6), np.zeros((6, 6))


@dataclass(frozen=True, slots=True)
class Reckoning:
    """What comes of propagating from the last comparison to this one."""

    chief: float
    """Largest distance of the ephemeris from its propagation, over what is allowed after a time t: `kernels.NOISE` +
    1/2 a t^2, with the largest unmodelled acceleration a. Infinite for an ephemeris that is no orbit."""
    chief_seconds: float
    """Longest of the propagations, s."""
    jump: list[float] | None
    """Estimate less the propagated estimate of the last comparison, (6,), beyond what the unmodelled acceleration may
    differ by between the satellites, in standard deviations of the latter; None without two estimates of one run of the
    filter."""
    drift: list[float] | None
    """The same of an estimate of up to `kernels.WINDOW` before."""


class DeadReckoner:
    """Propagates chief and deputy under the point mass with J2 and the applied thrust, from comparison to comparison.

    Thrust enters tick by tick, as an impulse in its middle, by Hill's equations.
    """

    def __init__(self, tick_ns: int, thrust: Vector) -> None:
        """Without a memory.

        Args:
            tick_ns: of the run, ns.
            thrust: memory of `kernels.tally`: it takes the thrust since the last comparison from it, and gives it the
                rate of the Hill frame.
        """
        self.ticks = min(max(1, round(INTERVAL * NANOSECONDS / tick_ns)), TICKS)
        """Between comparisons."""
        self._seconds = self.ticks * tick_ns / NANOSECONDS
        self._thrust = thrust
        self._lengths = np.array([0.0, WINDOW])
        self._anchors = np.zeros((2, 7))
        self._tracks, self._covariances = np.zeros((2, 13)), np.zeros((2, 6, 6))
        self._out = np.zeros(2 + 12)
        self.reset()

    def reset(self) -> None:
        """Forget everything, after missed ticks."""
        self._anchors[:, 6] = self._tracks[:, 12] = -1.0

    def compare(self, measurement: Measurement, estimate: Estimate | None, continues: bool) -> Reckoning | None:
        """Compare, and start the next interval; None for the first one.

        Args:
            measurement: with the chief's ephemeris.
            estimate: of the same tick, finite.
            continues: whether its filter has run on since the last comparison.
        """
        given = reckon(
            measurement.chief_state,
            _NO_STATE if estimate is None else estimate.chief_state,
            _NO_STATE if estimate is None else estimate.relative_state,
            _NO_COVARIANCE if estimate is None else estimate.covariance,
            0 if estimate is None else 2 if continues else 1,
            self._seconds,
            self._anchors,
            self._tracks,
            self._covariances,
            self._lengths,
            self._thrust,
            self._out,
        )
        if not given & 1:
            return None
        out: list[float] = self._out.tolist()
        return Reckoning(out[0], out[1], out[2:8] if given & 2 else None, out[8:14] if given & 4 else None)
