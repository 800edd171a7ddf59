"""The force applied against the force commanded."""

from collections.abc import Sequence

from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import AXES


class ThrustResponse(Monitor):
    """Sum of what force and command differ by beyond the allowance, on each axis, over its limit.

    A command may act with a lag of a tick: the force may lie anywhere between the last two. For differences with a
    standard deviation s and an allowance k, the sum exceeds h with a chance below exp(-2 k h / s^2) (Lundberg). The
    allowance is a fiftieth of the limit, the coarseness of the thruster, and a tenth of the command.

    Assumes: telemetry of the applied force; a lag of a tick at most.
    Cannot see: what telemetry does not tell (`residual_acceleration` does); a loss below a tenth of the command; a
    thruster that is stuck where it is commanded to be.
    Delay: two ticks for a difference of the whole limit, h / (d - k) for one of d.
    """

    name = "thrust_response"
    title = "applied against commanded force, each axis"
    test = "CUSUM of the difference over the limit, k = 1/50, less a tenth of the command"
    when = When.THRUST

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The axes."""
        return AXES

    def feed(self, observation: Observation) -> None:
        """Judge the sums."""
        thrust = observation.thrust
        for axis, total in zip(AXES, thrust.sums, strict=True):
            self.judge(axis, total, thrust.suspect, thrust.failed)
