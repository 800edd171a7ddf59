"""Slots from a list of states."""

from copy import copy
from dataclasses import dataclass

import numpy as np

from formation_gnc.errors import ParameterError
from formation_gnc.guidance.curvilinear import curvilinear_from_hill
from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.orbit.constants import MU
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
    """Slots in free motion, each from a given state.

    Under Hill's equations a slot drifts along the track at the rate -3 (y' + 2 n x) of its state. A state that drifts
    less in the model of the target than it does there is kept in it as it is.
    """

    Parameters = SlotListParameters
    is_given = True

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

    def about(self, chief: Vector) -> "SlotList":
        """With the given state in curvilinear coordinates."""
        formation = copy(self)
        formation._start = curvilinear_from_hill(self._start[None], chief, np.zeros(1), MU)[0]
        return formation
