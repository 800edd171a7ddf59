"""A state that is not known well enough for the mode."""

from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation
from formation_gnc.supervision.thresholds import standard_deviations

ACQUISITION = 10.0
"""Factor on the limit while the formation is acquired."""

LIMITED = {Mode.KEEP: 1.0, Mode.RECONFIGURE: 1.0, Mode.ACQUIRE: ACQUISITION, Mode.AVOID: ACQUISITION}
"""Factor by mode; the others have no limit."""


class Covariance(Monitor):
    """Largest standard deviation of the position on an axis, against what the mode may have.

    Assumes: the filter's covariance is consistent, which others watch.
    Cannot see: an error that the covariance does not tell.
    Delay: ten ticks.
    """

    name = "covariance"
    title = "standard deviation of the position"
    test = "bound `largest_sigma`, ten times of it while the formation is acquired"

    def feed(self, observation: Observation) -> None:
        """Judge the variances."""
        if observation.estimate is None:
            return
        factor = LIMITED.get(observation.mode)
        if factor is None:
            self.forget("")
            return
        largest = max(standard_deviations(observation.estimate.covariance.diagonal().tolist()[:3]))
        limit = factor * self.parameters.largest_sigma
        self.judge("", largest, 0.5 * limit, limit)
