"""How the filter believes the deputy moves between two ticks."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.navigation import kernels
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.registry import MODELS
from formation_gnc.types import Matrix, Vector

LONGEST_STEP = 10.0
"""Integration step (s) above which a flight is divided, as in the plant."""


@dataclass(slots=True)
class Interval:
    """A flight of the deputy beside the chief."""

    chief: Vector
    """(6,) the chief's inertial state at its start, m and m/s."""
    next_chief: Vector
    """(6,) the same at its end."""
    acceleration: Vector
    """(3,) by thrust, along the Hill axes at the start, m/s^2."""
    duration: float
    """s."""
    substeps: int
    """Integration steps to take."""


class ProcessModel(ABC):
    """Moves relative states along a leg."""

    @abstractmethod
    def predict(self, leg: Interval, state: Vector, covariance: Matrix, noise: Matrix) -> tuple[Vector, Matrix, Matrix]:
        """State (6,), covariance with `noise` added (6, 6), and transition matrix (6, 6)."""

    @abstractmethod
    def move(self, leg: Interval, points: Matrix) -> Matrix:
        """Several relative states, (N, 6), alike."""


class NonlinearProcess(ProcessModel):
    """Two-body motion with J2 of both satellites: neither a circular chief nor a small separation is
    assumed."""

    def predict(self, leg: Interval, state: Vector, covariance: Matrix, noise: Matrix) -> tuple[Vector, Matrix, Matrix]:
        """In one kernel, the transition by the variational equations."""
        state, covariance, transition = state.copy(), covariance.copy(), np.empty((6, 6))
        kernels.fly(
            state,
            covariance,
            transition,
            leg.chief,
            leg.next_chief,
            noise,
            leg.acceleration,
            leg.duration,
            leg.substeps,
        )
        return state, covariance, transition

    def move(self, leg: Interval, points: Matrix) -> Matrix:
        """Each in the inertial frame."""
        moved: Matrix = kernels.fly_points(
            leg.chief, leg.next_chief, points, leg.acceleration, leg.duration, leg.substeps
        )
        return moved


class LinearProcess(ProcessModel):
    """A time-invariant linear model about the chief's orbit at the start of the run.

    What it leaves out (eccentricity, curvature, the turning of the thrust in the Hill frame over a tick)
    has to be covered by the process noise.
    """

    def __init__(self, model: RelativeModel) -> None:
        """With the model's own transition matrices."""
        self._discretise = lru_cache(maxsize=64)(lambda duration: model.discretise(0.0, duration))

    def predict(self, leg: Interval, state: Vector, covariance: Matrix, noise: Matrix) -> tuple[Vector, Matrix, Matrix]:
        """x = Phi x + Gamma a."""
        phi, gamma = self._discretise(leg.duration)
        return phi @ state + gamma @ leg.acceleration, kernels.spread(phi, covariance, noise), phi

    def move(self, leg: Interval, points: Matrix) -> Matrix:
        """The same for several."""
        phi, gamma = self._discretise(leg.duration)
        moved: Matrix = points @ phi.T + gamma @ leg.acceleration
        return moved


def substeps(duration: float) -> int:
    """Integration steps for a flight of a duration, s, of either sign."""
    return max(1, ceil(abs(duration) / LONGEST_STEP))


def process_noise(density: float, duration: float) -> Matrix:
    """(6, 6) covariance that white acceleration of a density (m^2/s^3, each axis) adds over a duration, s.

    That of a double integrator: over a tick, orbital motion changes it by a part in (n t)^2.
    """
    unit = np.eye(3)
    cubic, square = duration**3 / 3.0 * unit, duration**2 / 2.0 * unit
    return density * np.block([[cubic, square], [square, duration * unit]])


def _process(model: type[RelativeModel]) -> Callable[[CommonParameters], ProcessModel] | None:
    """How a filter predicts with a model; None when it cannot."""
    if model.is_exact_under_j2:
        return lambda common: NonlinearProcess()
    if model.is_linear and model.is_time_invariant:
        return lambda common: LinearProcess(model.about(common.chief_elements))
    return None


PROCESS_MODELS: dict[str, Callable[[CommonParameters], ProcessModel]] = {
    name: process for name, model in MODELS.items() if (process := _process(model)) is not None
}
"""The models of the registry that a filter can predict with, by name."""
