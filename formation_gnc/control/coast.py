"""No thrust."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Vehicle
from formation_gnc.records import NavigationState, Target


@dataclass(frozen=True)
class CoastParameters:
    """Coasting has nothing to set."""


class Coast(Controller):
    """Free flight: commands no thrust, whatever the error."""

    Parameters = CoastParameters

    def __init__(self, parameters: CoastParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Nothing to design."""

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """No force."""
        return Command(np.zeros(3))
