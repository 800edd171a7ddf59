"""Motion of the chief, for the equations of relative motion.

`KeplerChief` is an ellipse in closed form; `OblateChief` is an orbit under J2, integrated.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    mean_from_true_anomaly,
    state_from_elements,
    true_from_mean_anomaly,
)
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.orbit.gravity import acceleration as gravity
from formation_gnc.orbit.mean import mean_state
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.model import NO_THRUST, Array

STEPS_PER_TURN = 200
"""Integration steps per revolution of a circular orbit at the perigee: rounding error at order eight."""

DISTINCT_PERIGEE = 0.02
"""Least mean eccentricity at which the perigee is defined, against what J2 does to it."""

LATEST = 2048
"""Size of the caches of chief states."""


@dataclass(frozen=True)
class ChiefState:
    """Radius of the chief and rotation of its Hill frame at one instant, or, in arrays (...,), at many."""

    mu: float
    """Gravitational parameter, m^3/s^2."""
    radius: Any
    """Distance from the Earth's centre, m."""
    angular_rate: Any
    """Rate of the Hill frame about the orbit normal, h / r^2, rad/s (Joshi 3.25)."""
    angular_acceleration: Any
    """Its rate of change, rad/s^2 (Joshi 3.26)."""
    pole: Array
    """(..., 3) direction of the Earth's axis in the Hill frame: [sin i sin u, sin i cos u, cos i]."""
    tilt_rate: Any = 0.0
    """Rate of the Hill frame about the radial axis, r a_z / h, rad/s: zero unless the orbit plane turns."""


def frame_matrix(chief: ChiefState) -> Array:
    """(..., 6, 6) part of A due to the rotation of the Hill frame alone, without gravity.

    The in-plane rates are those of Joshi (3.22). The tilt of the orbit plane under J2 enters because the relative
    velocity of `formation_gnc.orbit.frames` excludes it: docs/theory/relative-motion.md.
    """
    rate, tilt = chief.angular_rate, chief.tilt_rate
    matrix = np.zeros((*np.shape(rate), 6, 6))
    matrix[..., :3, 3:] = np.eye(3)
    matrix[..., 3, 0] = matrix[..., 4, 1] = rate**2
    matrix[..., 3, 1] = chief.angular_acceleration
    matrix[..., 4, 0] = -chief.angular_acceleration
    matrix[..., 3, 4] = 2.0 * rate
    matrix[..., 4, 3] = -2.0 * rate
    matrix[..., 1, 2] = matrix[..., 4, 5] = tilt
    matrix[..., 2, 1] = matrix[..., 5, 4] = -tilt
    matrix[..., 3, 2] = rate * tilt
    matrix[..., 5, 0] = -rate * tilt
    return matrix


class Chief(ABC):
    """Orbit of the chief; instances of equal orbits compare equal."""

    @abstractmethod
    def at(self, time: float) -> ChiefState:
        """State at a time (s)."""

    def along(self, times: Array) -> ChiefState:
        """States at times (N,), s, in arrays."""
        states = [self.at(float(time)) for time in times]
        columns = {
            each.name: np.array([getattr(state, each.name) for state in states])
            for each in fields(ChiefState)
            if each.name != "mu"
        }
        return ChiefState(mu=states[0].mu, **columns)

    @property
    @abstractmethod
    def period(self) -> float:
        """Period of the argument of latitude, s."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step of an integration to rounding error, s, set by the motion at the perigee."""


@dataclass(frozen=True)
class KeplerChief(Chief):
    """A chief on an ellipse, under point-mass gravity, in closed form.

    Only models with J2 depend on the orientation. A perigee below the Earth's surface is accepted, as in Joshi's
    Table 8.2.

    Raises:
        OrbitError: a value that is not finite, a semi-major axis or gravitational parameter that is not positive,
            or an eccentricity outside [0, 1).
    """

    semi_major_axis: float
    eccentricity: float = 0.0
    inclination: float = 0.0
    argument_of_perigee: float = 0.0
    true_anomaly: float = 0.0
    """At time zero, rad."""
    mu: float = MU

    def __post_init__(self) -> None:
        """Reject what is not an ellipse."""
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise OrbitError(f"{name} is {value}: it must be finite")
        for name in ("semi_major_axis", "mu"):
            if not getattr(self, name) > 0.0:
                raise OrbitError(f"{name} is {getattr(self, name)}: it must be above zero")
        if not 0.0 <= self.eccentricity < 1.0:
            raise OrbitError(f"eccentricity is {self.eccentricity}: it must be in [0, 1)")

    @classmethod
    def of(cls, elements: Elements) -> "KeplerChief":
        """Chief with these elements at time zero."""
        return cls(
            elements.semi_major_axis,
            elements.eccentricity,
            elements.inclination,
            elements.argument_of_perigee,
            elements.true_anomaly,
        )

    @property
    def mean_motion(self) -> float:
        """Mean motion, rad/s."""
        return math.sqrt(self.mu / self.semi_major_axis**3)

    @property
    def parameter(self) -> float:
        """Semi-latus rectum, m."""
        return self.semi_major_axis * (1.0 - self.eccentricity**2)

    @property
    def period(self) -> float:
        """Period of revolution, s."""
        return math.tau / self.mean_motion

    @property
    def longest_step(self) -> float:
        """Longest step of an integration to rounding error, s, set by the motion at the perigee."""
        return _step_at(self.semi_major_axis * (1.0 - self.eccentricity), self.mu)

    def time_at(self, inertial: Array) -> float | None:
        """Time within a period, s, at which the true anomaly is that of an inertial state (6,); None if it has none."""
        anomaly = true_anomaly_of(inertial)
        if anomaly is None:
            return None
        here, start = (mean_from_true_anomaly(each, self.eccentricity) for each in (anomaly, self.true_anomaly))
        return (here - start) % math.tau / self.mean_motion

    def seen(self, inertial: Array, time: float) -> "KeplerChief | None":
        """The mean ellipse that an inertial state (6,) is on at a time (s); None if that has no distinct perigee.

        The osculating one turns to and fro with every revolution under J2, by an angle of J2 over the eccentricity.
        """
        try:
            ellipse = KeplerChief.of(elements_from_state(mean_state(inertial)))
        except OrbitError:
            return None
        if ellipse.eccentricity < DISTINCT_PERIGEE:
            return None
        return replace(ellipse, true_anomaly=ellipse.anomaly(-time))

    def anomaly(self, time: float) -> float:
        """True anomaly at a time, rad, in [0, 2 pi)."""
        mean = mean_from_true_anomaly(self.true_anomaly, self.eccentricity) + self.mean_motion * time
        return true_from_mean_anomaly(mean, self.eccentricity)

    def at(self, time: float) -> ChiefState:
        """State at a time (s)."""
        return _kepler_state(self, time)


@dataclass(frozen=True)
class OblateChief(Chief):
    """A chief under point-mass gravity and J2, integrated from its osculating elements at time zero."""

    elements: Elements

    @property
    def period(self) -> float:
        """Nodal period from time zero, s."""
        return _nodal_period(self)

    @property
    def longest_step(self) -> float:
        """Longest step of an integration to rounding error, s, set by the motion at the perigee."""
        return _step_at(self.elements.perigee_radius, MU)

    def inertial(self, time: float) -> Array:
        """(6,) inertial state at a time, s; the same bits in any order of calls."""
        return _oblate_inertial(self, time)

    def at(self, time: float) -> ChiefState:
        """State at a time (s)."""
        return _oblate_state(self, time)


def true_anomaly_of(inertial: Array) -> float | None:
    """True anomaly (rad) on the osculating orbit of an inertial state (6,); None if it is on no orbit."""
    place, velocity = inertial[:3].tolist(), inertial[3:].tolist()
    (x, y, z), (vx, vy, vz) = place, velocity
    momentum = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    square, radius = math.sumprod(momentum, momentum), math.sqrt(math.sumprod(place, place))
    if not (0.0 < square < math.inf and 0.0 < radius < math.inf):
        return None
    radial_rate = math.sumprod(place, velocity) / radius
    return math.atan2(math.sqrt(square) * radial_rate, square / radius - MU)


def latitude_of(inertial: Array) -> float | None:
    """Argument of latitude (rad) of an inertial state (6,); None if it is on no orbit."""
    if true_anomaly_of(inertial) is None:
        return None
    pole = hill_rotation(inertial)[:, 2]
    return math.atan2(pole[0], pole[1])


def _step_at(perigee_radius: float, mu: float) -> float:
    return math.tau / STEPS_PER_TURN * math.sqrt(perigee_radius**3 / mu)


# Cached: integrations evaluate the same instants repeatedly, plans hundreds of them.
@lru_cache(maxsize=LATEST)
def _kepler_state(chief: KeplerChief, time: float) -> ChiefState:
    anomaly = chief.anomaly(time)
    e = chief.eccentricity
    radius = chief.parameter / (1.0 + e * math.cos(anomaly))
    rate = math.sqrt(chief.mu * chief.parameter) / radius**2
    latitude = chief.argument_of_perigee + anomaly
    return ChiefState(
        mu=chief.mu,
        radius=radius,
        angular_rate=rate,
        angular_acceleration=-2.0 * chief.mu * e * math.sin(anomaly) / radius**3,
        pole=pole_in_hill_frame(chief.inclination, latitude),
    )


def pole_in_hill_frame(inclination: float, latitude: float) -> Array:
    """(3,) direction of the Earth's axis at an argument of latitude (rad)."""
    sin_i = math.sin(inclination)
    pole = np.array([sin_i * math.sin(latitude), sin_i * math.cos(latitude), math.cos(inclination)])
    pole.setflags(write=False)
    return pole


@lru_cache(maxsize=LATEST)
def _oblate_state(chief: OblateChief, time: float) -> ChiefState:
    inertial = chief.inertial(time)
    rotation = hill_rotation(inertial)
    radius = math.sqrt(float(inertial[:3] @ inertial[:3]))
    rate = float(rotation[1] @ inertial[3:]) / radius
    radial_rate = float(rotation[0] @ inertial[3:])
    _, along, normal = (float(component) for component in rotation @ gravity(inertial[:3]))
    pole = rotation[:, 2].copy()
    pole.setflags(write=False)
    return ChiefState(
        mu=MU,
        radius=radius,
        angular_rate=rate,
        angular_acceleration=(along - 2.0 * radial_rate * rate) / radius,
        pole=pole,
        tilt_rate=normal / (radius * rate),
    )


@lru_cache(maxsize=64)
def _oblate_inertial(chief: OblateChief, time: float) -> Array:
    """Integrate from the last knot before the time."""
    step = chief.longest_step
    index = max(math.floor(time / step), 0)
    knots = _knots(chief)
    while len(knots) <= index:
        knots.append(propagate_with_transition(knots[-1], NO_THRUST, step, 1)[0])
    rest = time - index * step
    state: Array = propagate_with_transition(knots[index], NO_THRUST, rest, max(1, math.ceil(abs(rest) / step)))[0]
    state.setflags(write=False)
    return state


@lru_cache(maxsize=16)
def _knots(chief: OblateChief) -> list[Array]:
    """States at multiples of the longest step, extended on demand."""
    return [state_from_elements(chief.elements)]


@lru_cache(maxsize=16)
def _nodal_period(chief: OblateChief) -> float:
    """Time at which the pole is in its initial direction again, by Newton's method on the angle."""
    start = chief.at(0.0).pole
    equatorial = math.hypot(start[0], start[1]) < 1e-9  # no node: angle from the initial position
    period = chief.elements.period

    def excess(time: float) -> float:
        if equatorial:
            here, there = chief.inertial(0.0), chief.inertial(time)
            turn = math.atan2(here[0] * there[1] - here[1] * there[0], here[:2] @ there[:2])
            return math.copysign(1.0, start[2]) * turn
        pole = chief.at(time).pole
        return math.atan2(pole[0] * start[1] - pole[1] * start[0], pole[:2] @ start[:2])

    for _ in range(20):
        change = -excess(period) / chief.at(period).angular_rate
        period += change
        if abs(change) < 1e-9:
            break
    return period
