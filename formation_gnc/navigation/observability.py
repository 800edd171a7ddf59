"""Which direction of the relative state the sensors cannot see.

A direction is a relative state with its rates divided by the mean motion, so that all six are in metres, of
unit length.
"""

from math import tau

import numpy as np

from formation_gnc.navigation import kernels
from formation_gnc.navigation.process import Interval, NonlinearProcess, substeps
from formation_gnc.orbit.frames import hill_transform
from formation_gnc.types import Matrix, Vector

UNOBSERVABLE = 1e-9
"""A direction about which the sensors tell less than this, relative to the best-seen one, is unobservable: both in
information, the square of an inverse length. Rounding and an imperfect linearisation leave 1e-13 of a
direction that has none."""

STEPS_PER_ORBIT = 120

AXES = ("radial", "along-track", "cross-track", "radial rate", "along-track rate", "cross-track rate")

NOTHING = np.zeros(6)

_AT_REST = np.zeros(3)
_ON_THE_CHIEF = np.zeros(6)
_NO_NOISE = np.zeros((6, 6))


def gramian(chief: Vector, variance: dict[int, float], window: float, state: Vector = _ON_THE_CHIEF) -> Matrix:
    """Observability Gramian of a deputy over a time to come: sum of (H Phi)' R^-1 (H Phi).

    Args:
        chief: inertial state at the start, (6,), m and m/s.
        variance: of the noise by sensor; each reads `STEPS_PER_ORBIT` times an orbit.
        window: s.
        state: relative state at the start, (6,).

    Returns:
        (6, 6) information on the relative state at the start, in m^-2, s m^-2, s^2 m^-2.
    """
    sensors = np.array(list(variance), dtype=np.int64)
    weight = 1.0 / np.array(list(variance.values()))
    step = orbit_period(chief) / STEPS_PER_ORBIT
    total, since = np.zeros((6, 6)), np.eye(6)
    for _ in range(max(1, round(window / step))):
        _, jacobian = kernels.read_relative(sensors, chief, state)
        seen = np.isfinite(jacobian).all(axis=1)
        total += information(jacobian[seen] @ since, weight[seen])
        later = kernels.coast(chief, _AT_REST, step, substeps(step))
        leg = Interval(chief, later, _AT_REST, step, substeps(step))
        state, _, transition = NonlinearProcess().predict(leg, state, _NO_NOISE, _NO_NOISE)
        chief, since = later, transition @ since
    return total


def information(jacobian: Matrix, weight: Vector) -> Matrix:
    """H' R^-1 H of readings with Jacobian (k, 6) and inverse variances (k,)."""
    told: Matrix = (jacobian * weight[:, None]).T @ jacobian
    return told


def unobservable_directions(gramian: Matrix, mean_motion: float) -> Matrix:
    """The directions, (b, 6), about which a Gramian has no information, the blindest first."""
    scale = np.repeat([1.0, mean_motion], 3)
    information, directions = np.linalg.eigh(gramian * np.outer(scale, scale))
    unobservable = directions.T[information <= UNOBSERVABLE * information[-1]]
    # An eigenvector is one up to its sign: let its largest component be positive.
    return np.array([each * np.sign(each[np.argmax(np.abs(each))]) for each in unobservable]).reshape(-1, 6)


def predicted_unobservable_direction(chief: Vector) -> Vector:
    """The direction (6,) that radius, range rate and latitude cannot see: a turn of the orbit about the
    Earth's axis.

    In the Hill frame of a circular chief at argument of latitude u it is
    [0, 0, cos i, 0, -sin i cos u, n sin i sin u] with position along-track cos i and cross-track -sin i cos
    u; here it is exact for any chief: a turn changes position by k x r and velocity by k x v, with k the
    Earth's axis.
    """
    rate = tau / orbit_period(chief)
    turned = np.array([-chief[1], chief[0], 0.0, -chief[4], chief[3], 0.0])
    direction: Vector = (hill_transform(chief) @ turned) / np.repeat([1.0, rate], 3)
    return direction / np.linalg.norm(direction)


def orbit_period(chief: Vector) -> float:
    """Period (s) of the circular orbit on which the chief would have its present angular rate."""
    momentum = np.cross(chief[:3], chief[3:])
    return float(tau * (chief[:3] @ chief[:3]) / np.sqrt(momentum @ momentum))


def in_words(directions: Matrix) -> str:
    """The unobservable directions (b, 6) by their largest components; empty when there are none."""
    return ", ".join(AXES[int(np.argmax(np.abs(each)))] for each in directions)


class Observability:
    """The Gramian of what the filter really took, over one window after the other, and the unobservable direction
    it shows.

    At the start of a window the state is x_0; a reading taken later says H Phi(t, t_0) x_0. A tick costs
    one product of matrices. Until the first window is full, the direction is that of the readings to be
    expected; a direction moves with the transition matrix from tick to tick.
    """

    def __init__(
        self, chief: Vector, state: Vector, variance: dict[int, float], window: float, mean_motion: float
    ) -> None:
        """Foresee what sensors with these variances will tell; see `gramian`."""
        self._mean_motion, self._window = mean_motion, window
        self._set(unobservable_directions(gramian(chief, variance, window, state), mean_motion))
        self._restart()

    def _restart(self) -> None:
        self._elapsed, self._since, self._told = 0.0, np.eye(6), np.zeros((6, 6))

    def _set(self, directions: Matrix) -> None:
        self.words = in_words(directions)
        self.direction = directions[0] if len(directions) else NOTHING
        """(6,) the blindest direction now; zero when everything is seen."""

    def fly(self, transition: Matrix, duration: float) -> bool:
        """Move along; returns whether a window has ended, and with it what is said of the unobservable direction."""
        self.direction = self._moved(self.direction, transition)
        kernels.compose(self._since, transition)
        self._elapsed += duration
        if self._elapsed < self._window:
            return False
        if self._told.any():
            unobservable = unobservable_directions(self._told, self._mean_motion)
            self._set(np.array([self._moved(each, self._since) for each in unobservable]).reshape(-1, 6))
        self._restart()
        return True

    def _moved(self, direction: Vector, transition: Matrix) -> Vector:
        """A copy, since an estimate holds the old one."""
        direction = direction.copy()
        kernels.carry(direction, transition, self._mean_motion)
        return direction

    def take(self, jacobian: Matrix, variance: Vector) -> None:
        """Count readings with Jacobian (k, 6) with respect to the present state."""
        kernels.inform(self._told, jacobian, self._since, variance)
