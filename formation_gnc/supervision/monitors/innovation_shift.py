"""Innovations whose mean is not zero: a sensor's bias or drift, or an error of the state."""

from collections.abc import Sequence
from math import nan
from typing import ClassVar

from formation_gnc.supervision.cusum import Cusum
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.thresholds import cusum_threshold, suspicion


class InnovationShift(Monitor):
    """Two-sided CUSUM of each value's normalised innovations, those that the gate refused included.

    Assumes: innovations of a healthy filter are white and normal with the predicted variance; no more readings than
    ticks. An outlier counts as three standard deviations.
    Cannot see: an error that the filter follows without contradiction, such as one along the unobservable direction;
    a shift below `reference`.
    Delay: close to (h + 1.2) / (shift - k) readings, with the shift in standard deviations, of which three count.
    """

    is_of_filter = True
    reference: ClassVar[float]
    """Half the shift that it is made for, k, standard deviations."""

    def prepare(self) -> None:
        """Thresholds for the sensors in use."""
        samples, share = self.parameters.ticks, self.probability / len(self.parameters.sensors)
        self._failed = cusum_threshold(self.reference, samples, share)
        self._suspect = cusum_threshold(self.reference, samples, suspicion(share))
        self._sums: dict[str, list[Cusum]] = {}

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The sensors."""
        return parameters.sensors

    def feed(self, observation: Observation) -> None:
        """Add the innovations of a tick."""
        if observation.estimate is None:
            return
        for each in observation.estimate.innovations:
            sums = self._sums.get(each.sensor)
            if sums is None or len(sums) != len(each.values):
                sums = self._sums[each.sensor] = [Cusum(self.reference, self._failed) for _ in each.values]
            largest = 0.0
            for cusum, value, sigma in zip(sums, each.values, each.standard_deviations, strict=False):
                total = cusum.add(value / sigma if sigma > 0.0 else nan)
                if total > largest:
                    largest = total
            self.judge(each.sensor, largest, self._suspect, self._failed)


class InnovationBias(InnovationShift):
    """CUSUM for shifts of two standard deviations and more: found within few readings."""

    name = "innovation_bias"
    title = "mean of a sensor's innovations, fast"
    test = "two-sided CUSUM, k = 1"
    when = When.READINGS
    reference = 1.0


class InnovationDrift(InnovationShift):
    """CUSUM for shifts of half a standard deviation: slow, for what grows slowly or is followed by the filter."""

    name = "innovation_drift"
    title = "mean of a sensor's innovations, slow"
    test = "two-sided CUSUM, k = 1/4"
    when = When.READINGS
    reference = 0.25
