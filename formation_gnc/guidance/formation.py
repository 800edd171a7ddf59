"""The interface of a formation."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Matrix, Vector


class Formation[P](ABC):
    """The relative orbit of one slot of a formation about a circular chief, with parameters of type `P`.

    A subclass's docstring states the geometry of the slots, the invariant in free flight and the source.
    `Parameters` is the class `P`, a frozen dataclass of :func:`formation_gnc.parameters.parameter` fields; they
    become parameters of the guidance node under the formation's name in the registry.
    """

    Parameters: ClassVar[type]
    is_given: ClassVar[bool] = False
    """Whether its slots are states that somebody gives, in the Cartesian Hill frame, not a shape."""

    @abstractmethod
    def __init__(self, parameters: P, mean_motion: float, slot: int = 0) -> None:
        """Prepare the relative orbit of a slot.

        Args:
            parameters: of the formation.
            mean_motion: of the chief, rad/s.
            slot: from 0.

        Raises:
            ConfigurationError: these parameters give no formation.
        """

    @staticmethod
    def slot_count(parameters: P) -> int | None:
        """Number of slots; None where it is unlimited."""
        return 1

    @abstractmethod
    def states(self, times: Vector) -> Matrix:
        """(N, 6) relative states, m and m/s, at times (N,) in s since the start of the run.

        In the coordinates of Hill's equations, which at large separations are curvilinear.
        """

    def elements(self, phase: float) -> Vector | None:
        """(6,) mean relative elements at time zero, m, at a phase (rad); None for a formation not given by them."""
        return None

    def about(self, chief: Vector) -> "Formation[P]":
        """The formation about a chief with an inertial state (6,) at time zero: itself, where it is a shape."""
        return self


class FreeMotion[P](Formation[P]):
    """A formation in free motion under Hill's equations, given by the state of each slot at time zero."""

    def __init__(self, parameters: P, mean_motion: float, slot: int = 0) -> None:
        """Start from `start`."""
        self._model = HillModel(mean_motion)
        self._start = self.start(parameters, mean_motion, slot)

    @classmethod
    @abstractmethod
    def start(cls, parameters: P, mean_motion: float, slot: int) -> Vector:
        """(6,) state of a slot at time zero, Hill frame, m and m/s."""

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states by the closed-form solution of Hill's equations."""
        states: Matrix = self._model.transition(0.0, times) @ self._start
        return states


def hill_from_lvlh(state: Vector) -> Vector:
    """Relative state (6,) in the Hill frame, from the ESA LVLH frame of Kremmydas.

    LVLH: x along-track, y against the orbit normal, z towards the Earth. Both frames have the same angular rate.
    """
    x, y, z, vx, vy, vz = state
    return np.array([-z, x, -y, -vz, vx, -vy])
