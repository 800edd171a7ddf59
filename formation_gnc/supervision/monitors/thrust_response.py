"""The force applied against the force commanded."""

from collections.abc import Sequence
from math import hypot, isfinite, log

from formation_gnc.supervision.monitor import AXES, Monitor, Observation, When, suspicion
from formation_gnc.supervision.parameters import SupervisorParameters

ALLOWED = 0.02
"""Allowed difference, over the limit of the axis."""

SCALE = 0.1
"""Allowed difference besides, over the command: scale and mounting."""

NOISE = 0.05
"""Standard deviation of a random difference, over the limit."""

CEILING = 4.0
"""Largest sum, over the threshold."""


class ThrustResponse(Monitor):
    """Sum of what force and command differ by beyond the allowance, on each axis, over its limit.

    A command may act with a lag of a tick: the force may lie anywhere between the last two. For differences with a
    standard deviation s and an allowance k, the sum exceeds h with a chance below exp(-2 k h / s^2) (Lundberg). The
    allowance is a fiftieth of the limit, the coarseness of the thruster, and a tenth of the command.

    Assumes: telemetry of the applied force; a lag of a tick at most.
    Cannot see: what telemetry does not tell (the innovations do); a loss below a tenth of the command; a thruster that
    is stuck where it is commanded to be.
    Delay: two ticks for a difference of the whole limit, h / (d - k) for one of d.
    """

    name = "thrust_response"
    title = "applied against commanded force, each axis"
    test = "CUSUM of the difference over the limit, k = 1/50, less a tenth of the command"
    when = When.ALWAYS

    def prepare(self) -> None:
        """Thresholds."""
        self._failed, self._suspect = self._threshold(self.probability), self._threshold(suspicion(self.probability))
        parameters = self.parameters
        coarse = max(parameters.dead_band, parameters.quantum, parameters.minimum_impulse / parameters.tick)
        self._limits = [each or max(*parameters.thrust_limit, 1e-9) for each in parameters.thrust_limit]
        self._allowed = [ALLOWED + coarse / limit for limit in self._limits]
        self._sums = [0.0, 0.0, 0.0]
        self._before: list[float] | None = None
        self._eclipse = False
        self._is_idle = False

    def _threshold(self, probability: float) -> float:
        return NOISE**2 * log(6.0 * self.parameters.ticks / probability) / (2.0 * ALLOWED)

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The axes."""
        return AXES

    def feed(self, observation: Observation) -> None:
        """Compare the force of the tick that has ended with its command."""
        commanded, applied = observation.commanded, observation.applied
        in_eclipse, measurement = self._eclipse, observation.measurement
        self._eclipse = measurement is not None and measurement.eclipse
        if commanded is None or applied is None:
            self._before = None
            return
        before, self._before = self._before, commanded
        if commanded == applied and self._is_idle:
            return
        expected = self._expected(commanded, in_eclipse)
        earlier = expected if before is None else self._expected(before, in_eclipse)
        scale = SCALE * max(map(abs, expected))
        for axis, limit in enumerate(self._limits):
            low, high = sorted((expected[axis], earlier[axis]))
            beyond = (max(low - applied[axis], applied[axis] - high, 0.0) - scale) / limit
            if not isfinite(beyond):
                beyond = 1.0
            total = max(0.0, self._sums[axis] + beyond - self._allowed[axis])
            self._sums[axis] = min(total, CEILING * self._failed)
            self.judge(AXES[axis], total, self._suspect, self._failed)
        self._is_idle = not any(self._sums)

    def _expected(self, commanded: list[float], in_eclipse: bool) -> list[float]:
        """Force (3,) that thrusters that are well give for a command, N."""
        if in_eclipse and self.parameters.off_in_eclipse:
            return [0.0, 0.0, 0.0]
        total, limit = hypot(*commanded), self.parameters.total_thrust
        if 0.0 < limit < total:
            return [each * limit / total for each in commanded]
        return commanded
