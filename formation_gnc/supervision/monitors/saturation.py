"""Demands beyond the limits of the thrusters."""

from math import tau

from formation_gnc.supervision.held import HeldTime
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation, When


class Saturation(Monitor):
    """Time with a demand beyond the limits: half a revolution in `keep`, two otherwise.

    Motion in orbit, and what holds against it, changes sign within half a revolution.

    Cannot see: a demand that is wrong but within the limits.
    Delay: the bound, and up to a minute.
    """

    name = "saturation"
    title = "demand beyond the limits for long"
    test = "bound, half a revolution in keep, two in other modes"
    when = When.RARE

    def prepare(self) -> None:
        """No time in saturation."""
        self._period, self._held = tau / self.parameters.mean_motion, HeldTime()

    def feed(self, observation: Observation) -> None:
        """Look at the status."""
        status = observation.status
        if status is not None:
            held = self._held.look(observation.time, True in status.saturated)
            self.judge("", held / ((0.5 if observation.mode is Mode.KEEP else 2.0) * self._period), 0.5, 1.0)
