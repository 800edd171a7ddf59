"""Separation from other satellites over hours of coasting, with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt, tau

import numpy as np
from scipy.special import ndtr

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.frames import hill_rotation, hill_transform_inverse, inertial_from_relative
from formation_gnc.orbit.propagation import Propagator, propagate_with_transition
from formation_gnc.types import Matrix, Vector

POINTS = 48
"""Points of a revolution; between two of them relative motion is straight."""

FINEST = 0.15
"""Longest integration step, over the time of a radian at perigee."""


@dataclass(frozen=True)
class Burn:
    """A held acceleration."""

    begin: float
    """s from the start of the plan."""
    end: float
    acceleration: tuple[float, float, float]
    """Hill frame, m/s^2."""

    @property
    def delta_v(self) -> float:
        """On all axes, m/s."""
        return (self.end - self.begin) * sum(map(abs, self.acceleration))


@dataclass(frozen=True)
class Outcome:
    """What comes of a plan."""

    separation: float
    """Least distance to any other satellite, m."""
    seconds: float
    """When that is, s from the start."""
    risk: float
    """Bound on the probability that the distance is below the limit at the worst time."""


class Forecast:
    """Coasting of a satellite and others under point mass and J2, and the uncertainty of the satellite's state.

    The probability that a position r with a covariance C lies within a limit L of the other satellite is at most that
    of any half-space that touches the sphere, Phi((L - u r) / sqrt(u C u)): the lesser one of u along r, and along
    C^-1 r, which has the most standard deviations. Over the horizon its largest value is taken. The covariance moves
    along the coasting orbit, from point to point; plans are flown as they are planned.
    """

    def __init__(
        self, chief: Vector, relative: Vector, covariance: Matrix, others: Matrix, limit: float, horizon: float
    ) -> None:
        """Propagate the covariance.

        Args:
            chief: inertial state (6,), m and m/s.
            relative: state of the satellite, (6,), Hill frame.
            covariance: of it, (6, 6).
            others: relative states (N, 6); that of the chief itself is zero.
            limit: of the distance, m.
            horizon: s.
        """
        axis, eccentricity, perigee = _orbit(chief)
        self.mean_motion = sqrt(MU / axis**3)
        """Of the chief, rad/s."""
        self.step = tau / self.mean_motion / POINTS
        """Between points, s."""
        self.points = max(2, ceil(horizon / self.step))
        fastest = sqrt(MU * (1.0 + eccentricity) / perigee**3)
        self._substeps = max(1, ceil(self.step * fastest / FINEST))
        self._propagator = Propagator(self.step, self._substeps)
        self._chief, self._limit = chief, limit
        self._others = np.array([inertial_from_relative(chief, each) for each in others])
        self._deputy = inertial_from_relative(chief, relative)
        self._covariances = self._propagated(covariance)

    def _propagated(self, covariance: Matrix) -> Matrix:
        """(K, 3, 3) covariances of the position, inertial, at every point."""
        to_inertial = hill_transform_inverse(self._chief)
        now, state, out = to_inertial @ covariance @ to_inertial.T, self._deputy, []
        for _ in range(self.points + 1):
            out.append(now[:3, :3])
            state, transition = propagate_with_transition(state, np.zeros(3), self.step, self._substeps)
            now = transition @ now @ transition.T
        return np.array(out)

    def outcomes(self, plans: Sequence[Sequence[Burn]]) -> list[Outcome]:
        """What comes of each of some plans; an empty one coasts. Burns are held over whole steps."""
        count = len(plans)
        last_burn = max((each.end for plan in plans for each in plan), default=0.0)
        states = np.vstack([self._chief, self._others, np.repeat(self._deputy[None], count, axis=0)])
        first, masses = 1 + len(self._others), np.ones(1 + len(self._others) + count)
        history = np.empty((self.points + 1, len(states), 6))
        accelerations = np.zeros((len(states), 3))
        for point in range(self.points + 1):
            history[point] = states
            seconds = point * self.step
            accelerations[:] = 0.0
            if seconds < last_burn:
                accelerations[first:] = _held(plans, seconds + 0.5 * self.step) @ hill_rotation(states[0])
            states = self._propagator.propagate(0.0, states, accelerations, masses)
        return [self._outcome(history, first, first + plan) for plan in range(count)]

    def _outcome(self, history: Matrix, first: int, satellite: int) -> Outcome:
        offsets = history[:, satellite, None] - history[:, 1:first]
        position, velocity = offsets[..., :3], offsets[..., 3:]
        speed = np.maximum((velocity**2).sum(axis=-1), 1e-300)
        nearest = np.clip(-(position * velocity).sum(axis=-1) / speed, -0.5 * self.step, 0.5 * self.step)
        nearest[0] = np.maximum(nearest[0], 0.0)
        position = position + nearest[..., None] * velocity
        distances = np.linalg.norm(position, axis=-1)
        risks = np.minimum(self._beyond(position, position), self._beyond(position, self._certain(position)))
        point, other = np.unravel_index(distances.argmin(), distances.shape)
        return Outcome(float(distances.min()), float(point * self.step + nearest[point, other]), float(np.max(risks)))

    def _certain(self, position: Matrix) -> Matrix:
        """(K, N, 3) C^-1 r of positions (K, N, 3), up to a factor."""
        solved = np.linalg.solve(self._covariances + 1e-12 * np.eye(3), position.swapaxes(1, 2))
        return np.asarray(solved.swapaxes(1, 2), dtype=np.float64)

    def _beyond(self, position: Matrix, along: Matrix) -> Matrix:
        """(K, N) probability of the half-space that touches the sphere across a direction (K, N, 3)."""
        towards = along / np.maximum(np.linalg.norm(along, axis=-1), 1e-300)[..., None]
        sigma = np.sqrt(np.maximum(np.einsum("kni,kij,knj->kn", towards, self._covariances, towards), 1e-12))
        return np.asarray(ndtr((self._limit - (position * towards).sum(axis=-1)) / sigma), dtype=np.float64)


def _held(plans: Sequence[Sequence[Burn]], seconds: float) -> Matrix:
    """(N, 3) acceleration of each plan at a time."""
    out = np.zeros((len(plans), 3))
    for row, plan in enumerate(plans):
        for burn in plan:
            if burn.begin <= seconds < burn.end:
                out[row] += burn.acceleration
    return out


def _orbit(state: Vector) -> tuple[float, float, float]:
    """Semi-major axis (m), eccentricity and perigee radius (m) of an inertial state (6,)."""
    position, velocity = state[:3], state[3:]
    radius, square = float(np.linalg.norm(position)), float(velocity @ velocity)
    axis = 1.0 / (2.0 / radius - square / MU)
    momentum = np.cross(position, velocity)
    eccentricity = sqrt(max(0.0, 1.0 - float(momentum @ momentum) / (MU * axis)))
    return axis, eccentricity, axis * (1.0 - eccentricity)
