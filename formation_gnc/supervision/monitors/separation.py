"""Predicted separations, with their uncertainty."""

from collections.abc import Sequence
from math import inf, sqrt

from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import NANOSECONDS

PLANNED, PASSIVE = "planned", "passive"
"""Subjects: along the targets' preview, and without thrust from now on."""

SIGMAS = 3.0
"""Standard deviations that a separation keeps from its limit."""


class Separation(Monitor):
    """Limit and three standard deviations of a predicted distance to the nearest neighbour, over that distance.

    The deviation of a planned one is that of the position. A passive one drifts besides, along the track, by 3/2 n t
    times the deviation of 4 x + 2 vy / n, the difference of semi-major axes (Hill).

    Assumes: a near-circular chief; neighbours known as well as the satellite itself, independently.
    Cannot see: what guidance has no neighbour for.
    Delay: the interval of guidance's predictions.
    """

    name = "separation"
    title = "predicted least distance to a neighbour, planned and without thrust"
    test = "bound `least_separation` and three standard deviations"
    when = When.SEPARATION

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """Planned and passive."""
        return (PLANNED, PASSIVE)

    def feed(self, observation: Observation) -> None:
        """Judge guidance's predictions."""
        separation, estimate, limit = observation.separation, observation.estimate, self.parameters.least_separation
        if separation is None or estimate is None or limit <= 0.0:
            return
        rows, n = estimate.covariance.tolist(), self.parameters.mean_motion
        position = max(rows[0][0], rows[1][1], rows[2][2])
        axis = 16.0 * rows[0][0] + 16.0 / n * rows[0][4] + 4.0 / n**2 * rows[4][4]
        ahead = max(0, separation.passive_time - separation.time) / NANOSECONDS
        for subject, distance, variance in (
            (PLANNED, separation.planned, position),
            (PASSIVE, separation.passive, position + (1.5 * n * ahead) ** 2 * axis),
        ):
            sigma = sqrt(2.0 * variance) if variance >= 0.0 else inf
            self.judge(subject, (limit + SIGMAS * sigma) / distance if distance > 0.0 else inf, 0.5, 1.0)
