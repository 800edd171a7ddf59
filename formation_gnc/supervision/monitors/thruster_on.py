"""Thrust to one side."""

from collections.abc import Sequence
from math import tau

from formation_gnc.supervision.held import HeldTime
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import AXES

TOLERANCE = 0.1
"""Force that counts as none, over the limit of the axis."""


class ThrusterOn(Monitor):
    """Time that an axis pushes to one side without a pause, by telemetry: half a revolution in `keep`, two otherwise.

    Assumes: a formation that is kept asks for forces that change sign with the orbit.
    Cannot see: a thruster that is on but told as off.
    Delay: the bound; a thruster that is on without a command is found by `thrust_response`.
    """

    name = "thruster_on"
    title = "thrust to one side for long, each axis"
    test = "bound, half a revolution in keep, two in other modes"
    when = When.RARE

    def prepare(self) -> None:
        """All off."""
        self._period = tau / self.parameters.mean_motion
        self._floors = [TOLERANCE * each for each in self.parameters.thrust_limit]
        self._held = [HeldTime() for _ in AXES]

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The axes."""
        return AXES

    def feed(self, observation: Observation) -> None:
        """Look at the applied force: a pause in between is not seen, one that lasts is."""
        if observation.measurement is None:
            return
        limit = (0.5 if observation.mode is Mode.KEEP else 2.0) * self._period
        applied = observation.measurement.applied_force.tolist()
        for axis, force, floor, held in zip(AXES, applied, self._floors, self._held, strict=True):
            side = 1 if force > floor else -1 if force < -floor else 0
            self.judge(axis, held.look(observation.time, side) / limit, 0.5, 1.0)
