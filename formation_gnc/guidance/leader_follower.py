"""Leader-follower formation."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class LeaderFollowerParameters:
    """Separation along the track."""

    separation: float = parameter(
        100.0,
        unit="m",
        in_flight=True,
        doc="along-track distance from each satellite to the next; negative for ahead of the chief",
    )


class LeaderFollower(Formation[LeaderFollowerParameters]):
    """At rest behind the chief on its track, slot k at [0, -(k + 1) separation, 0, 0, 0, 0].

    An equilibrium of Hill's equations, and so force-free about a circular chief.

    Source: Roberts, leader-follower of MUSTANG.
    """

    Parameters = LeaderFollowerParameters

    def __init__(self, parameters: LeaderFollowerParameters, mean_motion: float, slot: int = 0) -> None:
        """Any separation is allowed."""
        self._state = np.array([[0.0, -(slot + 1) * parameters.separation, 0.0, 0.0, 0.0, 0.0]])

    @staticmethod
    def slot_count(parameters: LeaderFollowerParameters) -> None:
        """Unlimited."""

    def states(self, times: Vector) -> Matrix:
        """(N, 6), the same state at all times."""
        return self._state.repeat(len(times), axis=0)
