"""Slots along one closed relative orbit."""

import math
from abc import abstractmethod
from dataclasses import dataclass

from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Vector


@dataclass(frozen=True)
class RingParameters:
    """Size of a closed relative orbit, and its number of slots."""

    size: float = parameter(
        1000.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="along-track semi-axis of the orbit"
    )
    satellites: int = parameter(
        4, minimum=1, maximum=1000, in_flight=True, doc="number of slots, equally spaced in time along the orbit"
    )


class Ring(FreeMotion[RingParameters]):
    """Slots equally spaced in time along one relative orbit centred on the chief.

    Slot k is k / satellites of a revolution ahead of slot 0 (Kremmydas, listings of the formation generators).
    """

    Parameters = RingParameters

    @staticmethod
    def slot_count(parameters: RingParameters) -> int:
        """`satellites`."""
        return parameters.satellites

    @classmethod
    def start(cls, parameters: RingParameters, mean_motion: float, slot: int) -> Vector:
        """The state of slot 0, propagated by the slot's share of a revolution."""
        later = math.tau * slot / (parameters.satellites * mean_motion)
        state: Vector = HillModel(mean_motion).transition(0.0, later) @ cls.first(parameters.size, mean_motion)
        return state

    @staticmethod
    @abstractmethod
    def first(size: float, mean_motion: float) -> Vector:
        """(6,) state of slot 0 at time zero, Hill frame, m and m/s."""
