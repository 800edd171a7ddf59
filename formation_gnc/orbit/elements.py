"""Keplerian elements and inertial states, singular cases included.

Usual conventions where an angle is undefined: on a circular orbit the argument of perigee is zero and the true
anomaly is counted from the ascending node; on an equatorial one, prograde or retrograde, the right ascension is
zero and the node lies on the inertial x axis.
"""

from dataclasses import dataclass, fields
from math import atan2, cos, hypot, isfinite, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU

Array = NDArray[np.float64]

SINGULAR = 1e-13
"""Eccentricity, or sine of inclination, below which a direction is rounding error and set by convention."""


@dataclass(frozen=True)
class Elements:
    """Keplerian elements of a closed orbit about the Earth: metres and radians.

    Raises:
        OrbitError: values that are not finite, an open orbit, a perigee below the Earth's surface, or an
            inclination outside [0, pi].
    """

    semi_major_axis: float
    eccentricity: float
    inclination: float
    right_ascension: float
    argument_of_perigee: float
    true_anomaly: float

    def __post_init__(self) -> None:
        """Reject open orbits and those that meet the Earth."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not isfinite(value):
                raise OrbitError(f"{field.name} is {value}: it must be finite")
        if not self.semi_major_axis > 0.0:
            raise OrbitError(f"semi_major_axis is {self.semi_major_axis} m: it must be above zero")
        if not 0.0 <= self.eccentricity < 1.0:
            raise OrbitError(f"eccentricity is {self.eccentricity}: it must be in [0, 1)")
        if not 0.0 <= self.inclination <= pi:
            raise OrbitError(f"inclination is {self.inclination} rad: it must be in [0, pi]")
        if self.perigee_radius < EARTH_RADIUS:
            raise OrbitError(
                f"perigee radius is {self.perigee_radius:.1f} m: it must be at least the Earth's, {EARTH_RADIUS:.1f} m"
            )

    @property
    def perigee_radius(self) -> float:
        """Smallest distance from the Earth's centre, m."""
        return self.semi_major_axis * (1.0 - self.eccentricity)

    @property
    def mean_motion(self) -> float:
        """Keplerian mean motion, rad/s."""
        return sqrt(MU / self.semi_major_axis**3)

    @property
    def period(self) -> float:
        """Keplerian period, s."""
        return tau / self.mean_motion

    @property
    def mean_anomaly(self) -> float:
        """Mean anomaly, rad, in [0, 2 pi)."""
        return mean_from_true_anomaly(self.true_anomaly, self.eccentricity)


def state_from_elements(elements: Elements, mu: float = MU) -> Array:
    """Inertial state of an orbit.

    Args:
        elements: Keplerian elements.
        mu: gravitational parameter, m^3/s^2.

    Returns:
        ``[r, v]``, (6,), m and m/s.
    """
    e = elements.eccentricity
    parameter = elements.semi_major_axis * (1.0 - e * e)
    cos_node, sin_node = cos(elements.right_ascension), sin(elements.right_ascension)
    cos_i, sin_i = cos(elements.inclination), sin(elements.inclination)
    latitude = elements.argument_of_perigee + elements.true_anomaly
    cos_u, sin_u = cos(latitude), sin(latitude)
    node = np.array([cos_node, sin_node, 0.0])
    ahead = np.array([-sin_node * cos_i, cos_node * cos_i, sin_i])
    radius = parameter / (1.0 + e * cos(elements.true_anomaly))
    speed = sqrt(mu / parameter)
    along_node = -speed * (sin_u + e * sin(elements.argument_of_perigee))
    along_ahead = speed * (cos_u + e * cos(elements.argument_of_perigee))
    return np.concatenate((radius * (cos_u * node + sin_u * ahead), along_node * node + along_ahead * ahead))


def elements_from_state(state: Array, mu: float = MU) -> Elements:
    """Osculating Keplerian elements of an inertial state; angles in [0, 2 pi).

    Args:
        state: ``[r, v]``, (6,), m and m/s.
        mu: gravitational parameter, m^3/s^2.

    Raises:
        OrbitError: a state that is not finite, of zero radius, rectilinear, or on an orbit that is open or meets
            the Earth's surface.
    """
    values = [float(value) for value in state]
    if len(values) != 6 or not all(isfinite(value) for value in values):
        raise OrbitError(f"inertial state is {values}: it must be six finite numbers")
    rx, ry, rz, vx, vy, vz = values
    radius = sqrt(rx * rx + ry * ry + rz * rz)
    if radius == 0.0:
        raise OrbitError("radius is 0 m: it must be above zero")
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    h = sqrt(hx * hx + hy * hy + hz * hz)
    if h == 0.0:
        raise OrbitError("angular momentum is 0 m^2/s: the orbit must have a plane")
    inverse_axis = 2.0 / radius - (vx * vx + vy * vy + vz * vz) / mu
    if inverse_axis <= 0.0:
        raise OrbitError(
            f"specific orbital energy is {-0.5 * mu * inverse_axis:.6g} J/kg: it must be below zero (a closed orbit)"
        )
    hx, hy, hz = hx / h, hy / h, hz / h
    sin_i = hypot(hx, hy)
    right_ascension = 0.0 if sin_i < SINGULAR else atan2(hx, -hy)
    nx, ny = cos(right_ascension), sin(right_ascension)
    latitude = atan2(rz * (hx * ny - hy * nx) + hz * (ry * nx - rx * ny), rx * nx + ry * ny)
    parameter = h * h / mu
    e_cos = parameter / radius - 1.0
    e_sin = (rx * vx + ry * vy + rz * vz) * sqrt(parameter / mu) / radius
    eccentricity = hypot(e_cos, e_sin)
    true_anomaly = latitude if eccentricity < SINGULAR else atan2(e_sin, e_cos)
    return Elements(
        semi_major_axis=1.0 / inverse_axis,
        eccentricity=eccentricity,
        inclination=atan2(sin_i, hz),
        right_ascension=wrap(right_ascension),
        argument_of_perigee=wrap(latitude - true_anomaly),
        true_anomaly=wrap(true_anomaly),
    )


def wrap(angle: float) -> float:
    """Angle in [0, 2 pi), rad."""
    wrapped = angle % tau
    return 0.0 if wrapped == tau else wrapped


def eccentric_anomaly(mean_anomaly: float, eccentricity: float) -> float:
    """Solution E of Kepler's equation ``M = E - e sin E``, to rounding error.

    Args:
        mean_anomaly: M, rad, any number of turns.
        eccentricity: e in [0, 1).

    Returns:
        E, rad, on the same turn as M.

    Raises:
        OrbitError: an eccentricity outside [0, 1).
    """
    if not 0.0 <= eccentricity < 1.0:
        raise OrbitError(f"eccentricity is {eccentricity}: it must be in [0, 1)")
    turns = tau * round(mean_anomaly / tau)
    target = mean_anomaly - turns
    # Monotonic function: Newton's method inside a shrinking bracket converges for every e.
    low, high = (0.0, pi) if target >= 0.0 else (-pi, 0.0)
    anomaly = min(max(target + eccentricity * sin(target), low), high)
    for _ in range(100):
        residual = anomaly - eccentricity * sin(anomaly) - target
        if residual > 0.0:
            high = anomaly
        else:
            low = anomaly
        step = residual / (1.0 - eccentricity * cos(anomaly))
        following = anomaly - step
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if following == anomaly or abs(following - anomaly) < 1e-16 * abs(anomaly):
            break
        anomaly = following
    return turns + anomaly


def true_from_mean_anomaly(mean_anomaly: float, eccentricity: float) -> float:
    """True anomaly in [0, 2 pi), rad, of a mean anomaly."""
    half = 0.5 * eccentric_anomaly(mean_anomaly, eccentricity)
    return wrap(2.0 * atan2(sqrt(1.0 + eccentricity) * sin(half), sqrt(1.0 - eccentricity) * cos(half)))


def mean_from_true_anomaly(true_anomaly: float, eccentricity: float) -> float:
    """Mean anomaly in [0, 2 pi), rad, of a true anomaly."""
    half = 0.5 * true_anomaly
    eccentric = 2.0 * atan2(sqrt(1.0 - eccentricity) * sin(half), sqrt(1.0 + eccentricity) * cos(half))
    return wrap(eccentric - eccentricity * sin(eccentric))
