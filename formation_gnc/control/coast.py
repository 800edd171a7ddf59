"""Free drift."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Vehicle
from formation_gnc.records import NavigationState, Target


@dataclass(frozen=True)
class CoastParameters:
    """No parameters."""


class Coast(Controller[CoastParameters]):
    """Free drift: zero thrust at any error."""

    Parameters = CoastParameters

    def __init__(self, parameters: CoastParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Nothing to design."""

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Zero force."""
        return Command(np.zeros(3))
