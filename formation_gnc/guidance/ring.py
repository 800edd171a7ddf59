"""Satellites that follow one another round the same closed relative orbit."""

import math
from abc import abstractmethod
from dataclasses import dataclass

from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Vector


@dataclass(frozen=True)
class RingParameters:
    """A closed relative orbit and how many share it."""

    size: float = parameter(
        1000.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="along-track half axis of the orbit"
    )
    satellites: int = parameter(
        4, minimum=1, maximum=1000, in_flight=True, doc="places, equally spaced in time round the orbit"
    )


class Ring(FreeMotion):
    """Places at equal intervals of time round one relative orbit centred on the chief.

    Place k is where the first will be k / satellites of a revolution later (Kremmydas, listings of the
    formation generators).
    """

    Parameters = RingParameters

    @staticmethod
    def places(parameters: RingParameters) -> int:
        """As many as are to share the orbit."""
        return parameters.satellites

    @classmethod
    def start(cls, parameters: RingParameters, mean_motion: float, slot: int) -> Vector:  # type: ignore[override]
        """The first place's state, carried round."""
        later = math.tau * slot / (parameters.satellites * mean_motion)
        state: Vector = HillModel(mean_motion).transition(0.0, later) @ cls.first(parameters.size, mean_motion)
        return state

    @staticmethod
    @abstractmethod
    def first(size: float, mean_motion: float) -> Vector:
        """(6,) state of the first place at time zero, Hill frame, m and m/s."""
