"""Dynamic inversion: feedback linearisation of the nonlinear relative motion."""

import cmath
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.inversion import InversionParameters, InvertingController
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class DynamicInversionParameters(InversionParameters):
    """Poles of the error."""

    natural_frequency: float = parameter(
        0.003, unit="rad/s", above=0.0, in_flight=True, doc="natural frequency of the error on each axis"
    )
    damping: float = parameter(
        1.0, above=0.0, maximum=10.0, in_flight=True, doc="damping ratio of the error; 1: the fastest without overshoot"
    )


class DynamicInversion(InvertingController[DynamicInversionParameters]):
    """Feedback linearisation: on every axis e'' = -k_d e' - k_p e on the nonlinear equations with J2.

    u = f(x_d) - f(x) + feed-forward - k_d e' - k_p e. The gains place the poles of the double integrator with thrust
    held over a tick at exp(s T), s^2 + 2 zeta w s + w^2 = 0. The output is the position, of relative degree two on all
    three axes, which leaves no zero dynamics. Source: Isidori, Nonlinear Control Systems, 5.3; Joshi's outlook.

    Thrust beyond the limit as in `InvertingController`.

    Assumes: three thrusters, or no cross-track one; a model as good as the cancellation is to be: what it lacks, d,
    leaves an offset of d / k_p.
    """

    Parameters = DynamicInversionParameters

    def __init__(self, parameters: DynamicInversionParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Place the poles.

        Raises:
            DesignError: no thruster in the plane, or a sampled loop that is unstable at the thrust limit.
        """
        super().__init__("dynamic_inversion", parameters, common, vehicle)
        tick, rate, damping = common.tick, parameters.natural_frequency, parameters.damping
        root = cmath.sqrt(damping**2 - 1.0)
        poles = [cmath.exp(-rate * tick * (damping + sign * root)) for sign in (1.0, -1.0)]
        total, product = (poles[0] + poles[1]).real, (poles[0] * poles[1]).real
        self.position_gain = (1.0 - total + product) / tick**2
        """1/s^2."""
        self.velocity_gain = (3.0 - total - product) / (2.0 * tick)
        """1/s."""
        self.check(np.hstack([self.position_gain * np.eye(3), self.velocity_gain * np.eye(3)]), "natural_frequency")

    def wanted(self, off: Vector) -> Vector:
        """The acceleration with the chosen poles."""
        acceleration: Vector = -self.position_gain * off[:3] - self.velocity_gain * off[3:]
        return acceleration

    def figures(self) -> dict[str, Any]:
        """The gains of the linearised axes."""
        return {"position gain [1/s^2]": self.position_gain, "velocity gain [1/s]": self.velocity_gain}
