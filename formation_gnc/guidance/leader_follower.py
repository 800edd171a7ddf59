"""One behind the other."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.interface import Matrix, Vector
from formation_gnc.mission import Mission
from formation_gnc.parameters import parameter


@dataclass(frozen=True)
class LeaderFollowerParameters:
    """Where the follower flies."""

    separation: float = parameter(
        100.0, unit="m", in_flight=True, doc="distance behind the chief along its track; negative flies ahead"
    )


class LeaderFollower(Formation):
    """At rest behind the chief on its track: [0, -separation, 0, 0, 0, 0].

    An equilibrium of Hill's equations, so it needs no thrust about a circular chief (Roberts,
    leader-follower of MUSTANG).
    """

    Parameters = LeaderFollowerParameters

    def __init__(self, parameters: LeaderFollowerParameters, mission: Mission) -> None:
        """Any separation will do."""
        self._state = np.array([0.0, -parameters.separation, 0.0, 0.0, 0.0, 0.0])

    def states(self, times: Vector) -> Matrix:
        """The same state at all times."""
        return np.tile(self._state, (len(times), 1))
