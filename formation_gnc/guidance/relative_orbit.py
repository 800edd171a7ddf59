"""The parametrised relative orbit of Joshi."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import Formation
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class RelativeOrbitParameters:
    """The six constants of a relative orbit, named as in the source."""

    rho: float = parameter(
        1000.0, unit="m", minimum=0.0, in_flight=True, doc="radial amplitude; twice that along-track"
    )
    theta: float = parameter(0.0, unit="rad", in_flight=True, doc="phase at the start of the run")
    a: float = parameter(0.0, unit="m", in_flight=True, doc="radial offset; makes the orbit drift along-track")
    b: float = parameter(0.0, unit="m", in_flight=True, doc="along-track offset")
    m: float = parameter(0.0, in_flight=True, doc="slope of the cross-track motion in phase with the radial one")
    n: float = parameter(0.0, in_flight=True, doc="slope of the cross-track motion in phase with the along-track one")


class RelativeOrbit(Formation):
    """General free solution of Hill's equations (Joshi 4.14-4.19, with the factor omega that 4.17 lacks).

    Needs no thrust about a circular chief; for any other it is Joshi's desired trajectory, at the constant
    rate sqrt(mu / a^3).
    """

    Parameters = RelativeOrbitParameters

    def __init__(self, parameters: RelativeOrbitParameters, mean_motion: float, slot: int = 0) -> None:
        """Any constants will do."""
        self._constants = parameters
        self._rate = mean_motion

    def states(self, times: Vector) -> Matrix:
        """States at times (N,), Joshi 4.14-4.19."""
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
