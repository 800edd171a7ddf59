"""The time-averaged J2 model of Schweighart and Sedwick, and its cross-track extension."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import latitude_of
from formation_gnc.relative.hill import HarmonicModel
from formation_gnc.relative.model import ON_THE_CHIEF, Array, LinearModel


@dataclass(frozen=True)
class CircularReference:
    """Circular reference orbit of the linearisation, with the mean rates of latitude and node under J2.

    Raises:
        OrbitError: a radius below the Earth's surface, or a value that is not finite.
    """

    radius: float
    """m."""
    inclination: float
    """rad."""
    latitude: float = 0.0
    """Argument of latitude at time zero, rad."""

    def __post_init__(self) -> None:
        """Reject what is not an orbit."""
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise OrbitError(f"{name} is {value}: it must be finite")
        if not self.radius > EARTH_RADIUS:
            raise OrbitError(f"radius is {self.radius} m: it must be above the Earth's, {EARTH_RADIUS} m")

    @classmethod
    def of(cls, elements: Elements) -> "CircularReference":
        """Reference for a near-circular chief with these elements at time zero."""
        latitude = elements.argument_of_perigee + elements.true_anomaly
        return cls(elements.semi_major_axis, elements.inclination, latitude)

    @property
    def mean_motion(self) -> float:
        """Keplerian rate n, rad/s."""
        return math.sqrt(MU / self.radius**3)

    @property
    def oblateness(self) -> float:
        """J2 Re^2 / r^2."""
        return J2 * EARTH_RADIUS**2 / self.radius**2

    @property
    def averaged(self) -> float:
        """Averaged J2 acceleration over the central one: Roberts' s (13)."""
        return 0.375 * self.oblateness * (1.0 + 3.0 * math.cos(2.0 * self.inclination))

    @property
    def rate(self) -> float:
        """Corrected orbital rate n c, rad/s: Roberts (15)."""
        return self.mean_motion * math.sqrt(1.0 + self.averaged)

    @property
    def nodal_rate(self) -> float:
        """Frequency k of equator crossings, rad/s: Roberts (30)."""
        return self.rate + 1.5 * self.mean_motion * self.oblateness * math.cos(self.inclination) ** 2

    @property
    def node_shear(self) -> float:
        """Differential nodal rate of planes of different inclination, d(node rate)/di sin i, rad/s."""
        return 1.5 * self.mean_motion * self.oblateness * math.sin(self.inclination) ** 2

    def latitude_at(self, time: float) -> float:
        """Argument of latitude k t at a time, rad: Roberts (31)."""
        return self.latitude + self.nodal_rate * time

    def time_at(self, chief: Array, time: float) -> float:
        """Time within a nodal period at which the latitude is that of an inertial state (6,); `time` if it has none."""
        latitude = latitude_of(chief)
        return time if latitude is None else (latitude - self.latitude) % math.tau / self.nodal_rate


@dataclass(frozen=True)
class SchweighartSedwickModel(HarmonicModel):
    """Linear relative motion of two satellites under J2, with the gradient of J2 averaged over an orbit.

    Time-invariant and of Hill's form: Roberts (24). Assumes: near-circular orbits, curvilinear coordinates,
    separations much smaller than the radius. Neglects the variation of J2 within an orbit, and lets planes of
    different inclination precess about the wrong axis (see `SchweighartSedwickNodalModel`).
    """

    has_j2 = True

    reference: CircularReference

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the circular reference of the chief's osculating semi-major axis."""
        return cls(CircularReference.of(chief))

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """Frame's rate n c, in-plane frequency n sqrt(1 - s), cross-track frequency n sqrt(1 + 3 s), rad/s."""
        n, s = self.reference.mean_motion, self.reference.averaged
        return self.reference.rate, n * math.sqrt(1.0 - s), n * math.sqrt(1.0 + 3.0 * s)

    def centred(self, time: float, state: Array) -> Array:
        """(..., 6) state with the radial and along-track rates of Roberts (32), (33): no drift, no offset.

        The deputy then circles the chief; `bounded` keeps the radial rate, and with it an offset.
        """
        w, q, _ = self.frequencies
        result = self.bounded(time, state)
        result[..., 3] = q**2 / (2.0 * w) * result[..., 1]
        return result

    def on_the_equator(self, state: Array) -> Array:
        """(..., 6) state of one perturbed satellite relative to the reference orbit, at an equator crossing.

        Without drift and offset over the following orbits: Roberts (28)-(30). Both satellites of a formation
        start so, each about the same reference.
        """
        reference = self.reference
        result = self.centred(0.0, state)
        kick = 0.75 * reference.oblateness * reference.mean_motion**2 * reference.radius / reference.nodal_rate
        result[..., 4] += kick * math.sin(reference.inclination) ** 2
        return result


@dataclass(frozen=True)
class SchweighartSedwickNodalModel(LinearModel):
    """The averaged model with the cross-track motion due to differential nodal precession.

    In-plane as `SchweighartSedwickModel`. Cross-track, the two orbit planes intersect at small angles:
    z = r (di sin u - dO cos u), u = k t, where the difference of the nodes dO (times sin i) grows at the constant
    rate `node_shear` times the difference of inclination di. This is Roberts (25), z'' + q^2 z = 2 l q
    cos(q t + phi), to first order in the separation, as a linear time-varying equation without singularity; his
    q, l and phi are functions of the initial state and undefined for a zero one.
    """

    is_periodic = True
    has_closed_form = True
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

    @property
    def in_plane(self) -> SchweighartSedwickModel:
        """Model of the in-plane motion."""
        return SchweighartSedwickModel(self.reference)

    def phase_rates(self, time: float) -> tuple[float, float]:
        """In-plane frequency, and rate of the argument of latitude, rad/s."""
        return self.in_plane.frequencies[1], self.reference.nodal_rate

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t)."""
        k, shear = self.reference.nodal_rate, self.reference.node_shear
        matrix = self.in_plane.dynamics()
        planes, rate = self._planes(time)
        # z = row @ [di, dO], so z'' = row'' @ [di, dO] + 2 row' @ [0, shear di]
        u = self.reference.latitude_at(time)
        second = -(k**2) * planes[0] + np.array([2.0 * k * math.sin(u) * shear, 0.0])
        matrix[5, [2, 5]] = second @ rate
        return matrix

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix, in closed form."""
        phi = self.in_plane.transition(time, duration)
        parting = np.array([[1.0, 0.0], [self.reference.node_shear * duration, 1.0]])
        phi[np.ix_([2, 5], [2, 5])] = self._planes(time + duration)[0] @ parting @ self._planes(time)[1]
        return phi

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (6, 6) in closed form, and Gamma (6, 3), cross-track by integration."""
        _, gamma = super().discretise(time, tick)
        return self.transition(time, tick), gamma

    def bounded(self, time: float, state: Array) -> Array:
        """(..., 6) state without along-track drift; the cross-track motion is unchanged."""
        return self.in_plane.bounded(time, state)

    def _planes(self, time: float) -> tuple[Array, Array]:
        """Matrix from [di, dO sin i] to [z, vz], and its inverse (both (2, 2), the radius divided out)."""
        k, shear = self.reference.nodal_rate, self.reference.node_shear
        u = self.reference.latitude_at(time)
        sine, cosine = math.sin(u), math.cos(u)
        matrix = np.array([[sine, -cosine], [(k - shear) * cosine, k * sine]])
        determinant = k - shear * cosine**2
        inverse = np.array([[k * sine, cosine], [(shear - k) * cosine, sine]]) / determinant
        return matrix, inverse
