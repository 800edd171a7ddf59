"""A control law of one's own: proportional-derivative control of each axis."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.api import (
    Command,
    CommonParameters,
    Controller,
    DesignError,
    NavigationState,
    Target,
    Vehicle,
    parameter,
)


@dataclass(frozen=True)
class ProportionalDerivativeParameters:
    """Poles of the closed loop on a double integrator; each becomes a parameter `pd.NAME` of the controller."""

    natural_frequency: float = parameter(0.003, unit="rad/s", above=0.0, in_flight=True, doc="natural frequency")
    damping: float = parameter(1.0, minimum=0.0, in_flight=True, doc="damping ratio")


class ProportionalDerivative(Controller[ProportionalDerivativeParameters]):
    """Control of each axis as a double integrator: f = -m (w^2 dr + 2 zeta w dv)."""

    Parameters = ProportionalDerivativeParameters

    def __init__(
        self, parameters: ProportionalDerivativeParameters, common: CommonParameters, vehicle: Vehicle
    ) -> None:
        """Compute the gain (3, 6); raises DesignError for an undamped loop."""
        if parameters.damping == 0.0:
            raise DesignError("pd: damping is 0; it must be above 0 for a stable loop")
        frequency = parameters.natural_frequency
        self.gain = np.hstack([frequency**2 * np.eye(3), 2.0 * parameters.damping * frequency * np.eye(3)])

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Force (3,) for the tick, Hill frame, N."""
        return Command(-estimate.mass * self.gain @ (estimate.relative_state - target.relative_state))

    def figures(self) -> dict[str, Any]:
        """What `formation-gnc design` shows of the law."""
        return {"position gain [1/s^2]": float(self.gain[0, 0])}
