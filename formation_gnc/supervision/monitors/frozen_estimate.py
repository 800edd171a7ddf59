"""Estimates that repeat exactly."""

from formation_gnc.records import Estimate
from formation_gnc.supervision.monitor import Monitor, Observation

ONCE, TWICE = 1.0, 2.0
"""Repeats that are suspect, and a failure."""


class FrozenEstimate(Monitor):
    """Relative states of the estimate, ten ticks apart, that are equal to the last bit.

    Assumes: a filter that propagates: its state moves at every tick, if by little.
    Cannot see: an estimate that is stuck and still adds noise; its jumps then do not follow from the motion.
    Delay: thirty ticks at most.
    """

    name = "frozen_estimate"
    title = "estimates that repeat exactly"
    test = "two repeats"

    def prepare(self) -> None:
        """No estimate is known."""
        self._last: Estimate | None = None
        self._run = 0

    def feed(self, observation: Observation) -> None:
        """Compare the estimate of a tick with the last one; without one it begins anew."""
        estimate, last = observation.estimate, self._last
        self._last = estimate
        if estimate is None or last is None:
            self._run = 0
            return
        is_same = estimate.time > last.time and estimate.relative_state.tolist() == last.relative_state.tolist()
        self._run = self._run + 1 if is_same else 0
        self.judge("", float(self._run), ONCE, TWICE)
