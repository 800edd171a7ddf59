"""Neighbours that guidance has no state of."""

from formation_gnc.supervision.held import HeldTime
from formation_gnc.supervision.monitor import Monitor, Observation

SILENCE, TICKS = 60.0, 10
"""Time with fewer neighbours than there were that is a failure, s, and at least so many ticks."""


class Neighbours(Monitor):
    """Time for which guidance has had the states of fewer neighbours than it has had before.

    Assumes: a fleet that does not shrink on purpose.
    Cannot see: a neighbour that was never heard, nor one that gives a wrong state; which one is silent.
    Delay: the bound.
    """

    name = "neighbours"
    title = "neighbours that are silent"
    test = "bound, a minute and ten ticks with fewer of them than before"

    def prepare(self) -> None:
        """None heard."""
        self._most, self._held = 0, HeldTime()
        self._limit = max(SILENCE, TICKS * self.parameters.tick)

    def feed(self, observation: Observation) -> None:
        """Count those of the target."""
        if observation.target is None:
            return
        count = len(observation.target.neighbours)
        self._most = max(self._most, count)
        if self._most:
            self.judge("", self._held.look(observation.time, count < self._most) / self._limit, 0.5, 1.0)
