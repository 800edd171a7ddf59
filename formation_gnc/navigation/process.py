"""Process models: the motion that the filter predicts with."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.navigation.kernels import linear_algebra, motion
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.registry import MODELS
from formation_gnc.types import Matrix, Vector

LONGEST_STEP = 10.0
"""Longest integration step (s), as in the plant."""


@dataclass(slots=True)
class Interval:
    """Interval of a prediction, with the chief's motion and the thrust over it."""

    chief: Vector
    """(6,) chief's inertial state at its start, m and m/s."""
    next_chief: Vector
    """(6,) the same at its end."""
    acceleration: Vector
    """(3,) by thrust, along the Hill axes at the start, m/s^2."""
    duration: float
    """s."""
    substeps: int
    """Integration steps."""


class ProcessModel(ABC):
    """Propagates relative states over an interval."""

    @abstractmethod
    def predict(
        self, interval: Interval, state: Vector, covariance: Matrix, noise: Matrix
    ) -> tuple[Vector, Matrix, Matrix]:
        """State (6,), covariance with `noise` added (6, 6), and transition matrix (6, 6)."""

    @abstractmethod
    def propagate(self, interval: Interval, points: Matrix) -> Matrix:
        """Several relative states, (N, 6), at the end of the interval."""


class NonlinearProcess(ProcessModel):
    """Two-body motion with J2 of both satellites: any eccentricity and separation."""

    def predict(
        self, interval: Interval, state: Vector, covariance: Matrix, noise: Matrix
    ) -> tuple[Vector, Matrix, Matrix]:
        """One kernel; the transition by the variational equations."""
        state, covariance, transition = state.copy(), covariance.copy(), np.empty((6, 6))
        motion.predict(
            state,
            covariance,
            transition,
            interval.chief,
            interval.next_chief,
            noise,
            interval.acceleration,
            interval.duration,
            interval.substeps,
        )
        return state, covariance, transition

    def propagate(self, interval: Interval, points: Matrix) -> Matrix:
        """Each in the inertial frame."""
        propagated: Matrix = motion.propagate_points(
            interval.chief,
            interval.next_chief,
            points,
            interval.acceleration,
            interval.duration,
            interval.substeps,
        )
        return propagated


class LinearProcess(ProcessModel):
    """Time-invariant linear model about the chief's orbit at the start of the run.

    Process noise has to cover what it neglects: eccentricity, curvature, the rotation of held thrust in the Hill
    frame.
    """

    def __init__(self, model: RelativeModel) -> None:
        """Discretise a model as needed."""
        self._discretise = lru_cache(maxsize=64)(lambda duration: model.discretise(0.0, duration))

    def predict(
        self, interval: Interval, state: Vector, covariance: Matrix, noise: Matrix
    ) -> tuple[Vector, Matrix, Matrix]:
        """x = Phi x + Gamma a."""
        phi, gamma = self._discretise(interval.duration)
        propagated = linear_algebra.propagate_covariance(phi, covariance, noise)
        return phi @ state + gamma @ interval.acceleration, propagated, phi

    def propagate(self, interval: Interval, points: Matrix) -> Matrix:
        """x = Phi x + Gamma a."""
        phi, gamma = self._discretise(interval.duration)
        propagated: Matrix = points @ phi.T + gamma @ interval.acceleration
        return propagated


def substeps(duration: float) -> int:
    """Integration steps for a duration, s, of either sign."""
    return max(1, ceil(abs(duration) / LONGEST_STEP))


def process_noise(density: float, duration: float) -> Matrix:
    """(6, 6) covariance of white acceleration of a density (m^2/s^3, each axis) over a duration, s.

    That of a double integrator; over a tick, orbital motion changes it by a part in (n t)^2.
    """
    unit = np.eye(3)
    cubic, square = duration**3 / 3.0 * unit, duration**2 / 2.0 * unit
    return density * np.block([[cubic, square], [square, duration * unit]])


def _process(model: type[RelativeModel]) -> Callable[[CommonParameters], ProcessModel] | None:
    """Process with a relative model; None for one that a filter cannot predict with."""
    if model.is_exact_under_j2:
        return lambda common: NonlinearProcess()
    if model.is_linear and model.is_time_invariant:
        return lambda common: LinearProcess(model.about(common.chief_elements))
    return None


PROCESS_MODELS: dict[str, Callable[[CommonParameters], ProcessModel]] = {
    name: process for name, model in MODELS.items() if (process := _process(model)) is not None
}
"""Process models of the registry's relative models, by name."""
