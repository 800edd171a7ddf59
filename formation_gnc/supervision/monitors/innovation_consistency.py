"""Innovations that are larger, or smaller, than the filter predicts."""

from collections import deque

from formation_gnc.records import EstimateStatus
from formation_gnc.supervision.cusum import LARGEST
from formation_gnc.supervision.monitor import Monitor, Observation, When, suspicion
from formation_gnc.supervision.thresholds import chi_square_band

WINDOW = 60
"""Updates of a window: three times that of the filter, which inflates its covariance on its own."""


class InnovationConsistency(Monitor):
    """Sum over a window of the innovations squared, normalised (NIS), against chi-square on both sides.

    What the gate refused counts with its square, up to 25. An inflation of the covariance by the filter is a failure by
    the filter's own test.

    Assumes: white innovations with the predicted variance. The windows overlap, which raises fewer alarms than stated.
    Cannot see: noise that the filter has adapted to; which of the sensors it is.
    Delay: for innovations r times as large, half a window at r = 2.
    """

    name = "innovation_consistency"
    title = "size of all innovations"
    test = f"chi-square band of the NIS over {WINDOW} updates"
    when = When.READINGS

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
            freedom += len(each.values)
            if each.rejection:
                nis += sum(
                    min((value / sigma) ** 2, LARGEST**2) if sigma > 0.0 and value == value else LARGEST**2
                    for value, sigma in zip(each.values, each.standard_deviations, strict=False)
                )
        if len(self._window) == WINDOW:
            old, gone = self._window[0]
            self._sum, self._freedom = self._sum - old, self._freedom - gone
        self._window.append((nis, freedom))
        self._sum, self._freedom = self._sum + nis, self._freedom + freedom
        self._judge_window(estimate.status == EstimateStatus.DIVERGED)

    def _judge_window(self, diverged: bool) -> None:
        least, failed = chi_square_band(self._freedom, self.parameters.ticks, self.probability)
        _, suspect = chi_square_band(self._freedom, self.parameters.ticks, suspicion(self.probability))
        is_small = self._sum < least and len(self._window) == WINDOW
        statistic = 2.0 * failed if diverged or is_small else self._sum
        self.judge("", statistic, suspect, failed)
