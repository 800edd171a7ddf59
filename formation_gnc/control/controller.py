"""The interface of a control law."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from formation_gnc.common import CommonParameters
from formation_gnc.control.linear import LinearController
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import Matrix, Vector


@dataclass(slots=True)
class Command:
    """A law's output at a tick, before the thrust limit."""

    force: Vector
    """(3,) force to hold over the tick, Hill frame, N."""
    solver: str = ""
    """Status of the law's solver, if it has one."""
    iterations: int = 0
    cost: float = 0.0
    fallback: str = ""
    """Why the law's own answer could not be used, and what replaces it; empty when it is used."""


@dataclass(frozen=True)
class Handover:
    """State at the tick at which a law becomes active, for a bumpless transfer."""

    force: Vector
    """(3,) force commanded over the previous tick, Hill frame, N."""
    algorithm: str
    """Registry name of the law that commanded it; the law's own name when only parameters changed."""
    law: "Controller[Any] | None" = None
    """That law, whose internal state a law of the same class may take over."""


@dataclass(frozen=True)
class Vehicle:
    """Properties of the controlled deputy that a design depends on."""

    mass: float
    """Initial mass, kg."""
    thrust_limit: Vector
    """(3,) largest force per axis, N."""


class Controller[P](ABC):
    """A control law with parameters of type `P`: designed off the cycle, evaluated at every tick.

    A subclass's docstring states the law, its assumptions and its source. `Parameters` is the class `P`, a
    frozen dataclass of :func:`formation_gnc.parameters.parameter` fields; they become parameters of the
    controller node under the law's name in the registry.
    """

    Parameters: ClassVar[type]

    @abstractmethod
    def __init__(self, parameters: P, common: CommonParameters, vehicle: Vehicle) -> None:
        """Design the law; may be slow.

        Raises:
            DesignError: the parameters admit no law; the message gives the reason.
        """

    def activate(self, handover: Handover) -> None:  # noqa: B027 - optional for stateless laws
        """Initialise from the law that was active before: before the first `command`, and after a dead band.

        A law that comes back from its dead band is handed over by itself, without a state.
        """

    @abstractmethod
    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force for the tick that begins at the estimate's stamp."""

    def figures(self) -> dict[str, Any]:
        """Design figures by name with unit: numbers, lists of numbers, or words."""
        return {}

    def linear(self, time: int) -> LinearController | None:
        """Sampled linear form of the law, without limits, at a time of the run (ns); None if nonlinear.

        A law with a linear form has the parameter `model`, the relative-motion model of its design.
        """
        return None

    def singular_values(self, frequency: Vector) -> dict[str, Matrix]:
        """Singular values that the design bounds, by name with unit: (N, 3) over frequencies (N,), rad/s.

        Names that begin with "gamma /" are the bounds.
        """
        return {}
