"""Parametrised relative orbit."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class RelativeOrbitParameters:
    """The six constants of the relative orbit, named as by Joshi."""

    rho: float = parameter(
        1000.0, unit="m", minimum=0.0, in_flight=True, doc="radial amplitude, half of the along-track one"
    )
    theta: float = parameter(0.0, unit="rad", in_flight=True, doc="phase at the start of the run")
    a: float = parameter(0.0, unit="m", in_flight=True, doc="radial offset, which makes the orbit drift along-track")
    b: float = parameter(0.0, unit="m", in_flight=True, doc="along-track offset")
    m: float = parameter(0.0, in_flight=True, doc="slope of z with x: z = m x + n y about the centre")
    n: float = parameter(0.0, in_flight=True, doc="slope of z with y: z = m x + n y about the centre")


class RelativeOrbit(Formation[RelativeOrbitParameters]):
    """General solution of Hill's equations, in one slot.

    Force-free about a circular chief. About any other it is Joshi's desired trajectory, at the constant rate
    sqrt(mu / a^3).

    Source: Joshi (4.14)-(4.19), with the factor omega missing in (4.17).
    """

    Parameters = RelativeOrbitParameters

    def __init__(self, parameters: RelativeOrbitParameters, mean_motion: float, slot: int = 0) -> None:
        """Any constants are allowed."""
        self._constants = parameters
        self._rate = mean_motion

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states, Joshi (4.14)-(4.19)."""
        c, omega = self._constants, self._rate
        phase = omega * times + c.theta
        sine, cosine = c.rho * np.sin(phase), c.rho * np.cos(phase)
        return np.column_stack(
            [
                sine + c.a,
                2.0 * cosine - 1.5 * omega * c.a * times + c.b,
                c.m * sine + 2.0 * c.n * cosine,
                omega * cosine,
                -2.0 * omega * sine - 1.5 * omega * c.a,
                omega * (c.m * cosine - 2.0 * c.n * sine),
            ]
        )
