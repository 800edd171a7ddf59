"""What every formation can do."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np

from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Matrix, Vector


class Formation(ABC):
    """Relative orbits about a circular chief, one for each place of the formation.

    A subclass's docstring says where a deputy is to be, what stays the same in flight, and where that comes
    from; its `Parameters` are a frozen dataclass of :func:`formation_gnc.parameters.parameter` fields, and
    become the guidance node's parameters under the formation's name.
    """

    Parameters: ClassVar[type]

    @abstractmethod
    def __init__(self, parameters: Any, mean_motion: float, slot: int = 0) -> None:
        """Prepare the relative orbit of the deputy at a place.

        Args:
            parameters: the formation's own `Parameters`.
            mean_motion: angular rate of the chief, rad/s.
            slot: the place, from 0.

        Raises:
            ConfigurationError: these parameters give no formation.
        """

    @staticmethod
    def places(parameters: Any) -> int | None:
        """How many satellites find a place; None when it does not end."""
        return 1

    @abstractmethod
    def states(self, times: Vector) -> Matrix:
        """(N, 6) relative states, Hill frame, m and m/s, at times (N,) in s since the start of the run."""


class FreeMotion(Formation):
    """A formation whose satellites all move freely under Hill's equations, from a state each at time zero."""

    def __init__(self, parameters: Any, mean_motion: float, slot: int = 0) -> None:
        """Free motion from `start`."""
        self._model = HillModel(mean_motion)
        self._start = self.start(parameters, mean_motion, slot)

    @staticmethod
    @abstractmethod
    def start(parameters: Any, mean_motion: float, slot: int) -> Vector:
        """(6,) state at time zero of the deputy at a place, Hill frame, m and m/s."""

    def states(self, times: Vector) -> Matrix:
        """(N, 6) states by the closed form of Hill's equations."""
        states: Matrix = self._model.transition(0.0, times) @ self._start
        return states


def hill_from_lvlh(state: Vector) -> Vector:
    """Relative state (6,) in the Hill frame of one in the ESA LVLH frame that Kremmydas uses.

    LVLH: x along-track, y against the orbit normal, z towards the Earth; both frames turn alike.
    """
    x, y, z, vx, vy, vz = state
    return np.array([-z, x, -y, -vz, vx, -vy])
