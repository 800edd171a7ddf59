"""The Tschauner-Hempel equations, solved by Yamanaka and Ankersen's transition matrix."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.model import ON_THE_CHIEF, Array, LinearModel
from formation_gnc.relative.nonlinear import jacobian


@dataclass(frozen=True)
class TschaunerHempelModel(LinearModel):
    """Linear relative motion about a chief on an ellipse, under point-mass gravity.

    Exact in the chief's eccentricity, below one. Assumes: spherical Earth, separation much smaller than the
    radius. Source: Kremmydas section 1.1.4 for the model (equations misprinted: docs/theory/errata.md); the
    transition matrix is Yamanaka and Ankersen's (2002), in the axes used here.
    """

    is_periodic = True
    has_closed_form = True

    chief: KeplerChief

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the chief's osculating ellipse."""
        return cls(KeplerChief.of(chief))

    @property
    def period(self) -> float:
        """Period of the chief, s."""
        return self.chief.period

    @property
    def longest_step(self) -> float:
        """Longest integration step, s, set by the chief's motion at its perigee."""
        return self.chief.longest_step

    def time_at(self, chief: Array, time: float) -> float:
        """Time at which the true anomaly is that of an inertial state (6,)."""
        own = self.chief.time_at(chief)
        return time if own is None else own

    def anchored(self, chief: Array, time: float) -> Self:
        """About the mean ellipse of an inertial state (6,) at a time (s); the same if that is near-circular."""
        ellipse = self.chief.seen(chief, time)
        return self if ellipse is None else replace(self, chief=ellipse)

    def continued(self, state: Array, other: Self) -> Array:
        """(6,) state at time zero with the constants, by the true anomaly, of a state (6,) about another ellipse."""
        here, there = _Instant(self.chief, 0.0), _Instant(other.chief, 0.0)
        constants = there.constants() @ (there.to_anomaly() @ state)
        result: Array = here.to_time() @ (here.solutions(0.0) @ constants)
        return result

    def phase_rates(self, time: float) -> tuple[float, float]:
        """Rate of the chief's true anomaly for both, rad/s."""
        rate = self.chief.at(time).angular_rate
        return rate, rate

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t): Neokleous (1.11)."""
        return jacobian(ON_THE_CHIEF, self.chief.at(time))

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix, in closed form in the true anomaly."""
        start, end = _Instant(self.chief, time), _Instant(self.chief, time + duration)
        elapsed = math.sqrt(self.chief.mu / self.chief.parameter**3) * duration
        phi: Array = end.to_time() @ end.solutions(elapsed) @ start.constants() @ start.to_anomaly()
        return phi

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (6, 6) in closed form, and Gamma (6, 3) by integration."""
        _, gamma = super().discretise(time, tick)
        return self.transition(time, tick), gamma

    def bounded(self, time: float, state: Array) -> Array:
        """(..., 6) state with the along-track rate for which there is no secular term: equal energies, to first
        order."""
        result = np.array(state, dtype=np.float64)
        start = _Instant(self.chief, time)
        secular = (start.constants() @ start.to_anomaly())[3]
        result[..., 4] -= result @ secular / secular[4]
        return result


class _Instant:
    """The closed-form solutions at one true anomaly.

    In the variables rho [x, y, z] and their derivatives by the anomaly, rho = 1 + e cos(anomaly), the
    equations are x'' = 3 x / rho + 2 y', y'' = -2 x', z'' = -z.
    """

    def __init__(self, chief: KeplerChief, time: float) -> None:
        anomaly = chief.anomaly(time)
        self.e = e = chief.eccentricity
        self.sine, self.cosine = math.sin(anomaly), math.cos(anomaly)
        self.rho = 1.0 + e * self.cosine
        self.rate = math.sqrt(chief.mu / chief.parameter**3) * self.rho**2
        self.s, self.c = self.rho * self.sine, self.rho * self.cosine
        self.s_slope = self.cosine + e * (self.cosine**2 - self.sine**2)
        self.c_slope = -self.sine - 2.0 * e * self.sine * self.cosine

    def to_anomaly(self) -> Array:
        """(6, 6) map from the state to the variables by the anomaly."""
        matrix = np.diag(np.repeat([self.rho, self.rho / self.rate], 3))
        matrix[[3, 4, 5], [0, 1, 2]] = -self.e * self.sine
        return matrix

    def to_time(self) -> Array:
        """(6, 6) inverse of `to_anomaly`."""
        matrix = np.diag(np.repeat([1.0, self.rate], 3)) / self.rho
        matrix[[3, 4, 5], [0, 1, 2]] = self.rate * self.e * self.sine / self.rho**2
        return matrix

    def solutions(self, elapsed: float) -> Array:
        """(6, 6) independent solutions, one a column; the fourth is secular in `elapsed` = k^2 (t - t0)."""
        e, rho, s, c, j = self.e, self.rho, self.s, self.c, elapsed
        longer = 1.0 + 1.0 / rho
        matrix = np.zeros((6, 6))
        matrix[0, 1:4] = [s, c, 2.0 - 3.0 * e * s * j]
        matrix[1, :4] = [1.0, c * longer, -s * longer, -3.0 * rho**2 * j]
        matrix[3, 1:4] = [self.s_slope, self.c_slope, -3.0 * e * (self.s_slope * j + s / rho**2)]
        matrix[4, 1:4] = [-2.0 * s, e - 2.0 * c, -3.0 * (1.0 - 2.0 * e * s * j)]
        matrix[2, 4:] = [self.cosine, self.sine]
        matrix[5, 4:] = [-self.sine, self.cosine]
        return matrix

    def constants(self) -> Array:
        """(6, 6) inverse of `solutions` at zero elapsed."""
        e, rho, s, c = self.e, self.rho, self.s, self.c
        x, y, z, x_slope, y_slope, z_slope = np.eye(6)
        momentum = y_slope + 2.0 * x
        first = x - 2.0 * momentum
        second = x_slope + 3.0 * e * s / rho**2 * momentum
        determinant = e**2 - 1.0
        with_sine = ((self.c_slope + 3.0 * e**2 * s / rho**2) * first - (c - 2.0 * e) * second) / determinant
        with_cosine = (s * second - self.s_slope * first) / determinant
        longer = 1.0 + 1.0 / rho
        return np.array(
            [
                y - longer * (c * with_sine - s * with_cosine),
                with_sine,
                with_cosine,
                momentum - e * with_cosine,
                self.cosine * z - self.sine * z_slope,
                self.sine * z + self.cosine * z_slope,
            ]
        )
