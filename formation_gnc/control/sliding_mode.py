"""Sliding-mode control of the nonlinear relative motion, with a boundary layer."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.inversion import InversionParameters, InvertingController
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class SlidingModeParameters(InversionParameters):
    """Surface, reaching law and boundary layer."""

    sliding_rate: float = parameter(
        0.003, unit="1/s", above=0.0, in_flight=True, doc="rate at which the error decays on the sliding surface"
    )
    reaching: float = parameter(
        0.5,
        above=0.0,
        maximum=1.0,
        in_flight=True,
        doc="share of thrust_limit that drives towards the surface, and so the largest disturbance that is withstood",
    )
    layer_rate: float = parameter(
        0.006,
        unit="1/s",
        above=0.0,
        in_flight=True,
        doc="rate of decay towards the surface within the boundary layer, whose half width is reaching over it",
    )


class SlidingMode(InvertingController[SlidingModeParameters]):
    """Sliding mode with the surface s = e' + c e = 0 on every axis, on the nonlinear equations with J2.

    The equivalent control f(x_d) - f(x) + feed-forward - c e' holds s; beside it -eta sat(s / phi) reaches the layer
    |s| < phi against any disturbance below eta, in time |s| / (eta - d), and decays exponentially within. For thrust
    held over a tick T,

        w = -(c e' + eta sat(s / phi)) / (1 + c T / 2),   c = 2 / T tanh(sliding_rate T / 2),
        phi = eta T / (1 - exp(-layer_rate T)),

    for which s of the double integrator decays by exp(-layer_rate T) a tick in the layer, moves by eta T < phi outside
    and thus never crosses: no chattering, at any tick; on s = 0, e decays by exp(-sliding_rate T). A disturbance d
    leaves |s| <= phi d / eta and |e| <= |s| / c. Source: Slotine and Li, Applied Nonlinear Control, 7.1, 7.2, sampled;
    Joshi's outlook.

    There is no integral to wind up. Thrust beyond the limit as in `InvertingController`.

    Assumes: three thrusters, or no cross-track one.
    """

    Parameters = SlidingModeParameters

    def __init__(self, parameters: SlidingModeParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Sample the surface and the layer.

        Raises:
            DesignError: no thruster in the plane, or a sampled loop that is unstable at the thrust limit.
        """
        super().__init__("sliding_mode", parameters, common, vehicle)
        tick = common.tick
        self._slope = 2.0 / tick * math.tanh(0.5 * parameters.sliding_rate * tick)
        self._held = 1.0 + 0.5 * self._slope * tick
        self._decay = -math.expm1(-parameters.layer_rate * tick) / tick
        self._reaching = parameters.reaching * vehicle.thrust_limit / vehicle.mass
        gain = [self._decay * self._slope / self._held, (self._slope + self._decay) / self._held]
        self.check(np.hstack([each * np.eye(3) for each in gain]), "sqrt(sliding_rate layer_rate)")

    def surface(self, off: Vector) -> Vector:
        """s (3,), m/s, of an error (6,)."""
        value: Vector = off[3:] + self._slope * off[:3]
        return value

    def wanted(self, off: Vector) -> Vector:
        """Along the surface, and towards it."""
        towards = np.clip(self._decay * self.surface(off), -self._reaching, self._reaching)
        acceleration: Vector = -(self._slope * off[3:] + towards) / self._held
        return acceleration

    def figures(self) -> dict[str, Any]:
        """Slope of the surface, reaching acceleration and half width of the layer, by axis."""
        return {
            "slope of the surface [1/s]": self._slope,
            "reaching acceleration [m/s^2]": self._reaching.tolist(),
            "half width of the boundary layer [m/s]": (self._reaching / self._decay).tolist(),
        }
