"""Roberts' time-varying model: the gradient of J2 along a circular orbit."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.model import ON_THE_CHIEF, Array, LinearModel
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel


@dataclass(frozen=True)
class J2GradientModel(LinearModel):
    """Linear relative motion of two satellites under J2, periodic with the orbit: Roberts (19)-(21), (31).

    Includes the corrected orbital rate n c and the nodal correction k. Assumes: near-circular orbits,
    curvilinear coordinates, separations much smaller than the radius. The gradient acts about a reference with
    mean rates only; the neglected second-order terms cause an along-track drift (Roberts, Fig. 10).
    """

    is_periodic = True
    has_j2 = True

    reference: CircularReference

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the circular reference of the chief's osculating semi-major axis."""
        return cls(CircularReference.of(chief))

    @property
    def period(self) -> float:
        """Nodal period of the reference, s."""
        return math.tau / self.reference.nodal_rate

    @property
    def longest_step(self) -> float:
        """A hundredth of the nodal period, s."""
        return 0.01 * self.period

    def time_at(self, chief: Array, time: float) -> float:
        """Time at which the argument of latitude is that of an inertial state (6,)."""
        return self.reference.time_at(chief, time)

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t)."""
        n, rate = self.reference.mean_motion, self.reference.rate
        matrix = np.zeros((6, 6))
        matrix[:3, 3:] = np.eye(3)
        matrix[3:, :3] = n**2 * np.diag([2.0, -1.0, -1.0])
        matrix[3:, :3] += n**2 * circular_gradient(self.reference, self.reference.latitude_at(time))
        matrix[3, 0] += rate**2
        matrix[4, 1] += rate**2
        matrix[3, 4] = 2.0 * rate
        matrix[4, 3] = -2.0 * rate
        return matrix

    def centred(self, time: float, state: Array) -> Array:
        """(..., 6) state with the rates of Roberts (32), (33), which are those of the averaged model."""
        return SchweighartSedwickModel(self.reference).centred(time, state)


def circular_gradient(reference: CircularReference, latitude: float) -> Array:
    """(3, 3) gradient of the J2 acceleration over n^2, at an argument of latitude: Roberts (12)."""
    sin2_i, sin_2i = math.sin(reference.inclination) ** 2, math.sin(2.0 * reference.inclination)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    xx = 1.0 - 3.0 * sin2_i * sine**2
    xy = sin2_i * 2.0 * sine * cosine
    xz = sin_2i * sine
    yy = -0.25 - sin2_i * (0.5 - 1.75 * sine**2)
    yz = -0.25 * sin_2i * cosine
    zz = -0.75 + sin2_i * (0.5 + 1.25 * sine**2)
    return 6.0 * reference.oblateness * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
