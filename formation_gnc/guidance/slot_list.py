"""Slots from a list of states."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.errors import ParameterError
from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class SlotListParameters:
    """The states of the slots at time zero."""

    states: tuple[float, ...] = parameter(
        (0.0, -100.0, 0.0, 0.0, 0.0, 0.0),
        unit="m, m/s",
        minimum=-1e9,
        maximum=1e9,
        in_flight=True,
        doc="states of the slots at time zero, six numbers each, Hill frame",
    )


class SlotList(FreeMotion[SlotListParameters]):
    """Slots in free motion under Hill's equations, each from a given state.

    A slot drifts along the track at the rate -3 (y' + 2 n x) of its state.
    """

    Parameters = SlotListParameters

    @staticmethod
    def slot_count(parameters: SlotListParameters) -> int:
        """One per six numbers."""
        return len(parameters.states) // 6

    @classmethod
    def start(cls, parameters: SlotListParameters, mean_motion: float, slot: int) -> Vector:
        """The state given for the slot; raises ParameterError for an empty list, or part of a state."""
        count = len(parameters.states)
        if count == 0 or count % 6:
            raise ParameterError(
                f"parameter slot_list.states: {count} numbers are not allowed; it must be six for each slot"
            )
        return np.array(parameters.states[6 * slot : 6 * slot + 6])
