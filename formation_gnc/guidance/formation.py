"""What every formation can do, and all formations by name."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from formation_gnc.interface import Matrix, Vector
from formation_gnc.mission import Mission


class Formation(ABC):
    """A relative orbit for one deputy to follow.

    A subclass's docstring says where the deputy is to be and where that comes from; its `Parameters` are a
    frozen dataclass of :func:`formation_gnc.parameters.parameter` fields, and become the guidance node's
    parameters under the formation's name.
    """

    Parameters: ClassVar[type]

    @abstractmethod
    def __init__(self, parameters: Any, mission: Mission) -> None:
        """Prepare the relative orbit; raises ConfigurationError when these parameters give none."""

    @abstractmethod
    def states(self, times: Vector) -> Matrix:
        """(N, 6) relative states, Hill frame, m and m/s, at times (N,) in s since the start of the run."""
