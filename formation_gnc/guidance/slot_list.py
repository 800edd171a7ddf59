"""Any places one likes."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.formation import FreeMotion
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class SlotListParameters:
    """The states at time zero."""

    states: tuple[float, ...] = parameter(
        (0.0, -100.0, 0.0, 0.0, 0.0, 0.0),
        unit="m, m/s",
        minimum=-1e9,
        maximum=1e9,
        in_flight=True,
        doc="state of every place at time zero, six numbers each, Hill frame",
    )


class SlotList(FreeMotion):
    """Each place moves freely under Hill's equations from the state it is given: what stays is that state.

    A place drifts along the track by -3 (y' + 2 n x) times the time, as it is told to.
    """

    Parameters = SlotListParameters

    @staticmethod
    def places(parameters: SlotListParameters) -> int:
        """One for every six numbers."""
        return len(parameters.states) // 6

    @staticmethod
    def start(parameters: SlotListParameters, mean_motion: float, slot: int) -> Vector:
        """The state given for the place; raises ConfigurationError when the list has part of one."""
        count = len(parameters.states)
        if count == 0 or count % 6:
            raise ConfigurationError(
                f"parameter slot_list.states: {count} numbers are not allowed; it must be six for each place"
            )
        return np.array(parameters.states[6 * slot : 6 * slot + 6])
