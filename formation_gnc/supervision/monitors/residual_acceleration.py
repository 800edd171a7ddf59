"""Acceleration that neither gravity nor the thrust told explains."""

from collections.abc import Sequence

from formation_gnc.supervision.monitor import Monitor, Observation
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.thresholds import normal_threshold, suspicion
from formation_gnc.types import AXES


class ResidualAcceleration(Monitor):
    """Estimate less its propagation over up to five minutes, position and rate on each axis, over their deviation.

    What the filter's updates have added up to: a steady acceleration that is not told, such as by a thruster that is on
    but told as off, or the error of a state that readings correct. Their sum has the covariance before less that after,
    so each component is normal with a variance of one at most.

    Assumes: point mass with J2, and a bound on what differs by beyond it; process noise that is small over the window.
    Cannot see: an acceleration below the rate's deviation over the window; whether thruster, sensor or state is at
    fault.
    Delay: about the deviation of the rate, times the threshold, over the acceleration.
    """

    name = "residual_acceleration"
    title = "acceleration that the thrust told does not explain, each axis"
    test = "normal, position and rate after up to five minutes"
    is_of_filter = True

    def prepare(self) -> None:
        """Thresholds."""
        samples = 6 * self.parameters.ticks
        self._failed = normal_threshold(samples, self.probability)
        self._suspect = normal_threshold(samples, suspicion(self.probability))

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The axes."""
        return AXES

    def feed(self, observation: Observation) -> None:
        """Judge where there is a comparison."""
        reckoning = observation.reckoning
        if reckoning is not None and reckoning.drift is not None:
            drift = reckoning.drift
            for place, axis in enumerate(AXES):
                self.judge(axis, max(drift[place], drift[3 + place]), self._suspect, self._failed)
