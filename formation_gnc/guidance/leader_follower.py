"""One behind the other."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class LeaderFollowerParameters:
    """Where the follower flies."""

    separation: float = parameter(
        100.0,
        unit="m",
        in_flight=True,
        doc="distance from one to the next along the track; negative flies ahead",
    )


class LeaderFollower(Formation):
    """At rest behind the chief on its track, place k at [0, -(k + 1) separation, 0, 0, 0, 0].

    An equilibrium of Hill's equations, so it needs no thrust about a circular chief (Roberts, leader-follower
    of MUSTANG).
    """

    Parameters = LeaderFollowerParameters

    def __init__(self, parameters: LeaderFollowerParameters, mean_motion: float, slot: int = 0) -> None:
        """Any separation will do."""
        self._state = np.array([[0.0, -(slot + 1) * parameters.separation, 0.0, 0.0, 0.0, 0.0]])

    @staticmethod
    def places(parameters: LeaderFollowerParameters) -> None:
        """As many as one likes, each behind the last."""

    def states(self, times: Vector) -> Matrix:
        """The same state at all times."""
        return self._state.repeat(len(times), axis=0)
