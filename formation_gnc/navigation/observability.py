"""Unobservable directions of the relative state.

A direction is a relative state of unit length, its rates divided by the mean motion, so that all six components
are in metres.
"""

from math import tau

import numpy as np

from formation_gnc.navigation.kernels import linear_algebra, motion
from formation_gnc.navigation.kernels.measurement import measure_relative
from formation_gnc.navigation.measurement import measurement_model
from formation_gnc.navigation.process import Interval, NonlinearProcess, substeps
from formation_gnc.orbit.frames import hill_transform
from formation_gnc.types import Matrix, Vector

UNOBSERVABLE = 1e-9
"""Largest information on an unobservable direction, as a share of that on the best observed one. Rounding and
linearisation leave about 1e-13 where there is none."""

STEPS_PER_ORBIT = 120

AXES = ("radial", "along-track", "cross-track", "radial rate", "along-track rate", "cross-track rate")

NO_DIRECTION = np.zeros(6)

_NO_ACCELERATION = np.zeros(3)
_AT_CHIEF = np.zeros(6)
_NO_NOISE = np.zeros((6, 6))


def gramian(chief: Vector, variance: dict[str, tuple[float, ...]], window: float, state: Vector = _AT_CHIEF) -> Matrix:
    """Observability Gramian of a deputy over a time ahead: sum of (H Phi)' R^-1 (H Phi).

    Args:
        chief: inertial state at the start, (6,), m and m/s.
        variance: of the noise of each value, by sensor; each reads `STEPS_PER_ORBIT` times an orbit.
        window: s.
        state: relative state at the start, (6,).

    Returns:
        (6, 6) information on the relative state at the start, in m^-2, s m^-2, s^2 m^-2.
    """
    codes = measurement_model(tuple(variance)).codes
    weight = 1.0 / np.array([each for values in variance.values() for each in values])
    step = min(orbit_period(chief) / STEPS_PER_ORBIT, window)  # a chief with little speed across has a long period
    total, since = np.zeros((6, 6)), np.eye(6)
    for _ in range(max(1, round(window / step))):
        _, jacobian = measure_relative(codes, chief, state)
        defined = np.isfinite(jacobian).all(axis=1)
        total += information(jacobian[defined] @ since, weight[defined])
        later = motion.coast(chief, _NO_ACCELERATION, step, substeps(step))
        interval = Interval(chief, later, _NO_ACCELERATION, step, substeps(step))
        state, _, transition = NonlinearProcess().predict(interval, state, _NO_NOISE, _NO_NOISE)
        chief, since = later, transition @ since
    return total


def information(jacobian: Matrix, weight: Vector) -> Matrix:
    """H' R^-1 H of readings with Jacobian (m, 6) and inverse variances (m,)."""
    product: Matrix = (jacobian * weight[:, None]).T @ jacobian
    return product


def unobservable_directions(gramian: Matrix, mean_motion: float) -> Matrix:
    """Directions (b, 6) on which a Gramian has no information, the least observable first."""
    scale = np.repeat([1.0, mean_motion], 3)
    information, directions = np.linalg.eigh(gramian * np.outer(scale, scale))
    unobservable = directions.T[information <= UNOBSERVABLE * information[-1]]
    # The sign of an eigenvector is arbitrary: the largest component is positive.
    return np.array([each * np.sign(each[np.argmax(np.abs(each))]) for each in unobservable]).reshape(-1, 6)


def predicted_unobservable_direction(chief: Vector) -> Vector:
    """Direction (6,) that radius, range rate and latitude do not observe: a turn of the orbit about the Earth's axis.

    In the Hill frame of a circular chief at argument of latitude u it is
    [0, 0, cos i, 0, -sin i cos u, n sin i sin u] with position along-track cos i and cross-track -sin i cos u; here
    it is exact for any chief: a turn changes position by k x r and velocity by k x v, with k the Earth's axis.
    """
    rate = tau / orbit_period(chief)
    turned = np.array([-chief[1], chief[0], 0.0, -chief[4], chief[3], 0.0])
    direction: Vector = (hill_transform(chief) @ turned) / np.repeat([1.0, rate], 3)
    return direction / np.linalg.norm(direction)


def orbit_period(chief: Vector) -> float:
    """Period (s) of the circular orbit at the chief's present angular rate."""
    momentum = np.cross(chief[:3], chief[3:])
    return float(tau * (chief[:3] @ chief[:3]) / np.sqrt(momentum @ momentum))


def in_words(directions: Matrix) -> str:
    """Directions (b, 6) by their largest components; empty when there are none."""
    return ", ".join(AXES[int(np.argmax(np.abs(each)))] for each in directions)


class Observability:
    """Observability Gramian of the readings used, window after window, and the unobservable direction it shows.

    Until the first window ends, the direction is that of the readings expected. Each tick multiplies the direction
    and the transition since the window's start by the transition matrix.
    """

    def __init__(
        self,
        chief: Vector,
        state: Vector,
        variance: dict[str, tuple[float, ...]],
        window: float,
        mean_motion: float,
    ) -> None:
        """Start with the Gramian of a window ahead; arguments as `gramian`, mean motion in rad/s."""
        self._mean_motion, self._window = mean_motion, window
        self._set(unobservable_directions(gramian(chief, variance, window, state), mean_motion))
        self._begin_window()

    def _begin_window(self) -> None:
        self._elapsed, self._gramian = 0.0, np.zeros((6, 6))
        self.transition = np.eye(6)
        """(6, 6) since the start of the window."""

    def _set(self, directions: Matrix) -> None:
        self._directions = directions
        """(b, 6) unobservable ones at the start of the window."""
        self.words = in_words(directions)
        self.direction = directions[0] if len(directions) else NO_DIRECTION
        """(6,) least observable direction; zero when the state is observable."""

    def propagate(self, transition: Matrix, duration: float) -> bool:
        """Propagate by a transition matrix (6, 6) over a duration, s; returns whether a window has ended."""
        self.direction = self.direction.copy()  # estimates hold the old one
        motion.propagate_window(self.direction, self.transition, transition, self._mean_motion)
        self._elapsed += duration
        if self._elapsed < self._window:
            return False
        if self._gramian.any():
            self._directions = unobservable_directions(self._gramian, self._mean_motion)
            self._set(self._moved())
        else:
            self._directions = self._moved()
        self._begin_window()
        return True

    def _moved(self) -> Matrix:
        """(b, 6) unobservable directions now."""
        return np.array([self._propagated(each, self.transition) for each in self._directions]).reshape(-1, 6)

    def inflate(self, covariance: Matrix, factor: float) -> Matrix:
        """Multiply a covariance (6, 6) by a factor where readings observe the state.

        The functionals of the state that an unobservable direction does not change get the factor on their
        covariance; the variance along the direction, given these, stays, since no reading would take it back:
        P' = f P - (f - 1) U (U' P^-1 U)^-1 U' with the directions as columns of U.
        """
        if not len(self._directions):
            return covariance * factor
        scale = np.repeat([1.0, self._mean_motion], 3)
        directions = self._moved().T
        scaled = covariance / np.outer(scale, scale)
        kept = directions @ np.linalg.solve(directions.T @ np.linalg.solve(scaled, directions), directions.T)
        inflated: Matrix = (kept + factor * (scaled - kept)) * np.outer(scale, scale)
        linear_algebra.restore_definiteness(inflated)
        return inflated

    def _propagated(self, direction: Vector, transition: Matrix) -> Vector:
        """A copy: estimates hold the old one."""
        direction = direction.copy()
        motion.propagate_direction(direction, transition, self._mean_motion)
        return direction

    def add(self, jacobian: Matrix, variance: Vector) -> None:
        """Add readings with Jacobian (m, 6) with respect to the present state, and variances (m,)."""
        linear_algebra.accumulate_information(self._gramian, jacobian, self.transition, variance)
