"""What every control law can do."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from formation_gnc.common import CommonParameters
from formation_gnc.control.linear import LinearController
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import Matrix, Vector


@dataclass(slots=True)
class Command:
    """What a law asks for at a tick, before the thrust limit.

    A law with a solver reports on it; `fallback` says why its own answer could not be used.
    """

    force: Vector
    """(3,) force to hold over the tick, Hill frame, N."""
    solver: str = ""
    iterations: int = 0
    cost: float = 0.0
    fallback: str = ""


@dataclass(frozen=True)
class Handover:
    """What flew before, for a law that takes over at a tick without a jump in thrust."""

    force: Vector
    """(3,) force commanded over the tick before, Hill frame, N."""
    algorithm: str
    """Name of the law that commanded it; the own name when only parameters changed."""
    law: "Controller | None" = None
    """That law itself, whose memory one of the same kind may go on with."""


@dataclass(frozen=True)
class Vehicle:
    """What a law knows of the deputy it flies."""

    mass: float
    """Mass at the start, kg."""
    thrust_limit: Vector
    """(3,) largest force per axis, N."""


class Controller(ABC):
    """A control law: designed off the cycle, asked at every tick.

    A subclass's docstring says what the law does, what it assumes and where it comes from; its `Parameters`
    are a frozen dataclass of :func:`formation_gnc.parameters.parameter` fields, and become the controller
    node's parameters under the law's name in the registry.
    """

    Parameters: ClassVar[type]

    @abstractmethod
    def __init__(self, parameters: Any, common: CommonParameters, vehicle: Vehicle) -> None:
        """Design the law; may be slow.

        Raises:
            DesignError: no law follows from these parameters; the message says why.
        """

    def activate(self, handover: Handover) -> None:  # noqa: B027 - a law without memory has nothing to take over
        """Start from what flew before; called once, before the first `command`."""

    @abstractmethod
    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force for the tick that begins at the estimate's stamp."""

    def figures(self) -> dict[str, Any]:
        """What there is to say of the design: names with units, and numbers, lists of them or words."""
        return {}

    def linear(self, time: int) -> LinearController | None:
        """The law per tick, without limits, as it is at a time of the run (ns); none when it is not linear.

        A law that has one has the `model` that it is designed on among its parameters.
        """
        return None

    def singular_values(self, frequency: Vector) -> dict[str, Matrix]:
        """Those that the design bounds, by name with unit: (N, 3) over frequencies (N,), rad/s.

        Names that begin with "gamma /" are the bounds.
        """
        return {}
