"""The control law in use, its limits, and the swap from one law to another."""

from dataclasses import dataclass, make_dataclass
from typing import Any

import numpy as np

from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError
from formation_gnc.interface import Estimate, Status, Target, Thrust, Vector
from formation_gnc.parameters import parameter
from formation_gnc.part import Configuration, Part, Schedulable


@dataclass(frozen=True)
class AutopilotParameters(Schedulable):
    """What holds for every law."""

    algorithm: str = parameter("lqr", choices=tuple(ALGORITHMS), in_flight=True, doc="control law in use")
    mass: float = parameter(100.0, unit="kg", above=0.0, doc="deputy's mass at the start, for the design")
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01), unit="N", length=3, minimum=0.0, doc="largest force per Hill axis"
    )
    handover_step: float = parameter(
        0.1,
        above=0.0,
        maximum=2.0,
        in_flight=True,
        doc="largest step in force when a law takes over, as a share of thrust_limit; the rest follows in "
        "such steps, one a tick",
    )

    def __post_init__(self) -> None:
        """Raise ConfigurationError for thrusters that cannot push."""
        super().__post_init__()
        if not any(self.thrust_limit):
            raise ConfigurationError(
                f"parameter thrust_limit: {list(self.thrust_limit)} is not allowed; one axis must push"
            )


ControllerParameters: Any = make_dataclass(
    "ControllerParameters",
    [(name, law.Parameters) for name, law in ALGORITHMS.items()],
    bases=(AutopilotParameters,),
    frozen=True,
    kw_only=True,
    namespace={"__doc__": "Parameters of the controller node: what holds for every law, and each law's own."},
)


class Autopilot(Part[Any, Controller]):
    """Asks the law in use at every tick and holds its answer inside the limits.

    A command is finite and within the limit whatever comes in and whatever the law returns; what had to be
    changed is in the status. When a law takes over, what its first answer differs from the force flown
    before, beyond one step, is taken off and given back step by step.
    """

    def __init__(self, name: str, parameters: Any) -> None:
        """Design the law that `parameters.algorithm` names; raises ConfigurationError when it cannot be."""
        super().__init__(name, parameters)
        self._limit = np.array(parameters.thrust_limit)

    def forget(self) -> None:
        """Nothing has been flown yet."""
        self._force = np.zeros(3)
        self._predecessor: str | None = None
        self._withheld = np.zeros(3)
        self._fallback = ""

    def design(self, parameters: Any) -> Controller:
        """Design the named law from its own parameters."""
        law = ALGORITHMS[parameters.algorithm]
        vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
        return law(getattr(parameters, parameters.algorithm), parameters, vehicle)

    def take_over(self, old: Configuration[Any, Controller], new: Configuration[Any, Controller]) -> None:
        """Tell the new law what flew before."""
        self._predecessor = old.parameters.algorithm
        new.design.take_over(Handover(self._force, self._predecessor, old.design))

    def on_tick(self, estimate: Estimate, target: Target) -> tuple[Thrust, Status]:
        """The command for the tick that begins at the estimate's stamp, and how it came about."""
        self.begin_tick(estimate.time)
        command = self._ask(estimate, target)
        wanted = np.clip(command.force, -self._limit, self._limit)
        force = self._blend(estimate.time, wanted)
        self._note_fallback(estimate.time, command.fallback)
        self._force = force
        return Thrust(estimate.time, force), Status(
            estimate.time,
            self.parameters.algorithm,
            command.force,
            [bool(cut) for cut in np.abs(command.force) > self._limit],
            command.solver,
            command.iterations,
            command.cost,
            command.fallback,
        )

    def _ask(self, estimate: Estimate, target: Target) -> Command:
        """The law's answer, or no thrust with the reason when there is none to use."""
        for name, state in (("estimate", estimate.relative_state), ("target", target.relative_state)):
            if not np.isfinite(state).all():
                return Command(np.zeros(3), fallback=f"{name} not finite: no thrust")
        try:
            with np.errstate(all="ignore"):
                command = self.configuration.design.command(estimate, target)
        except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
            return Command(np.zeros(3), fallback=f"{type(error).__name__}: {error}: no thrust")
        if not np.isfinite(command.force).all():
            return Command(np.zeros(3), fallback="command not finite: no thrust")
        return command

    def _blend(self, time: int, wanted: Vector) -> Vector:
        """Bound the step at a hand-over, and give back what was withheld."""
        step = self.parameters.handover_step * self._limit
        if self._predecessor is not None:
            asked = wanted - self._force
            self._withheld = asked - np.clip(asked, -step, step)
            detail = (
                f"{self._predecessor} -> {self.parameters.algorithm}: step in force {_newtons(asked)} asked, "
            )
            self.record(time, "handover", detail + f"{_newtons(asked - self._withheld)} flown")
            self._predecessor = None
        elif self._withheld.any():
            self._withheld -= np.clip(self._withheld, -step, step)
        return np.clip(wanted - self._withheld, -self._limit, self._limit)

    def _note_fallback(self, time: int, reason: str) -> None:
        """Record when a fallback begins, changes or ends."""
        if reason != self._fallback:
            self.record(time, "fallback", reason or "over")
            self._fallback = reason


def _newtons(force: Vector) -> str:
    return "[" + ", ".join(f"{component:.3g}" for component in force) + "] N"
