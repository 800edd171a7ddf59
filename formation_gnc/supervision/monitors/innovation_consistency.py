"""Innovations that are larger than the filter predicts."""

from collections import deque

from formation_gnc.records import EstimateStatus, Rejection
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.thresholds import chi_square_limit, suspicion

WINDOW = 60

LARGEST = 5.0
"""Standard deviations as which a larger one of a refused reading counts."""
"""Updates of a window: three times that of the filter, which inflates its covariance on its own."""


class InnovationConsistency(Monitor):
    """Sum over a window of the innovations squared, normalised (NIS), against chi-square.

    What the gate refused counts with its square, up to 25; what is isolated does not count. An inflation of the
    covariance by the filter is a failure by the filter's own test.

    Smaller ones are no fault: process noise bounds what is not modelled, as the Earth's harmonics far from the chief.

    Assumes: white innovations with the predicted variance at most. The windows overlap, which raises fewer alarms than
    stated.
    Cannot see: noise that the filter has adapted to; which of the sensors it is.
    Delay: for innovations r times as large, half a window at r = 2.
    """

    name = "innovation_consistency"
    title = "size of all innovations"
    test = f"chi-square limit of the NIS over {WINDOW} updates"
    when = When.READINGS
    is_of_filter = True

    def prepare(self) -> None:
        """An empty window."""
        self._window: deque[tuple[float, int]] = deque(maxlen=WINDOW)
        self._sum, self._freedom = 0.0, 0

    def feed(self, observation: Observation) -> None:
        """Add the update of a tick, if there is one."""
        estimate = observation.estimate
        if estimate is None or not estimate.innovations:
            return
        nis, freedom = max(0.0, estimate.nis) if estimate.nis == estimate.nis else 0.0, 0
        for each in estimate.innovations:
            if each.rejection == Rejection.ISOLATED:
                continue
            freedom += len(each.values)
            if each.rejection:
                nis += sum(
                    min((value / sigma) ** 2, LARGEST**2) if sigma > 0.0 and value == value else LARGEST**2
                    for value, sigma in zip(each.values, each.standard_deviations, strict=False)
                )
        if not freedom:
            return
        if len(self._window) == WINDOW:
            old, gone = self._window[0]
            self._sum, self._freedom = self._sum - old, self._freedom - gone
        self._window.append((nis, freedom))
        self._sum, self._freedom = self._sum + nis, self._freedom + freedom
        self._judge_window(estimate.status == EstimateStatus.DIVERGED)

    def _judge_window(self, diverged: bool) -> None:
        failed = chi_square_limit(self._freedom, self.parameters.ticks, self.probability)
        suspect = chi_square_limit(self._freedom, self.parameters.ticks, suspicion(self.probability))
        self.judge("", 2.0 * failed if diverged else self._sum, suspect, failed)
