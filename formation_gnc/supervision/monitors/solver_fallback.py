"""A law on its fallback."""

from math import tau

from formation_gnc.supervision.held import HeldTime
from formation_gnc.supervision.monitor import Monitor, Observation, When

REVOLUTIONS = 0.02
"""Revolutions on a fallback that are a failure."""


class SolverFallback(Monitor):
    """Time on a fallback of the law, against a fiftieth of a revolution.

    So long does free motion leave a formation as it is: the drift of a state is a matter of the orbit.

    Cannot see: a solver that gives a bad answer in time.
    Delay: the bound, and up to a minute.
    """

    name = "solver_fallback"
    title = "law on its fallback for long"
    test = "bound, 1/50 of a revolution"
    when = When.RARE

    def prepare(self) -> None:
        """No time on a fallback."""
        self._limit = REVOLUTIONS * tau / self.parameters.mean_motion
        self._held = HeldTime()

    def feed(self, observation: Observation) -> None:
        """Look at the status."""
        status = observation.status
        if status is not None:
            held = self._held.look(observation.time, bool(status.fallback))
            self.judge("", held / self._limit, 0.5, 1.0)
