"""Estimates that do not follow from the one before."""

from formation_gnc.supervision.monitor import Monitor, Observation
from formation_gnc.supervision.thresholds import normal_threshold, suspicion


class EstimateJump(Monitor):
    """Estimate less the propagated estimate of ten ticks before, on each axis, over the deviation of the latter.

    Updates of a consistent filter move the state by less than its uncertainty before them: their covariance is that
    before less that after. So each component is normal with a variance of one at most.

    Assumes: point mass with J2 over ten ticks; applied force and mass as told. A start from a fix is no jump.
    Cannot see: a slow error of the state; a jump along a direction whose uncertainty is large.
    Delay: ten ticks at most.
    """

    name = "estimate_jump"
    title = "estimate against its own propagation"
    test = "normal, six components"
    is_of_filter = True

    def prepare(self) -> None:
        """Thresholds."""
        samples = 6 * self.parameters.ticks
        self._failed = normal_threshold(samples, self.probability)
        self._suspect = normal_threshold(samples, suspicion(self.probability))

    def feed(self, observation: Observation) -> None:
        """Judge where there is a comparison."""
        if observation.reckoning is not None and observation.reckoning.jump is not None:
            self.judge("", max(observation.reckoning.jump), self._suspect, self._failed)
