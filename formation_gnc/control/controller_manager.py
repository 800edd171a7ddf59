"""The control law in use, its limits, and the swap from one law to another."""

from collections.abc import Sequence
from dataclasses import dataclass, make_dataclass
from math import inf, isfinite
from typing import Any

import numpy as np

from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters
from formation_gnc.parameters import parameter
from formation_gnc.records import EventKind, NavigationState, Status, Target, Thrust


@dataclass(frozen=True)
class BaseControllerParameters(ModuleParameters):
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
    bases=(BaseControllerParameters,),
    frozen=True,
    kw_only=True,
    namespace={"__doc__": "Parameters of the controller node: what holds for every law, and each law's own."},
)


class ControllerManager(FlightModule[Any, Controller]):
    """Asks the law in use at every tick and holds its answer inside the limits.

    A command is finite and within the limit whatever comes in and whatever the law returns; what had to be
    changed is in the status. When a law takes over, what its first answer differs from the force flown
    before, beyond one step, is taken off and given back step by step.
    """

    def reset(self) -> None:
        """Nothing has been flown yet."""
        self._force = np.zeros(3)
        self._predecessor: str | None = None
        self._withheld = [0.0, 0.0, 0.0]
        self._fallback = ""

    def design(self, parameters: Any) -> Controller:
        """Design the named law from its own parameters."""
        law = ALGORITHMS[parameters.algorithm]
        vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
        return law(getattr(parameters, parameters.algorithm), parameters, vehicle)

    def activate(self, old: Configuration[Any, Controller], new: Configuration[Any, Controller]) -> None:
        """Tell the new law what flew before."""
        self._predecessor = old.parameters.algorithm
        new.design.activate(Handover(self._force, self._predecessor, old.design))

    def on_tick(self, estimate: NavigationState, target: Target) -> tuple[Thrust, Status]:
        """The command for the tick that begins at the estimate's stamp, and how it came about."""
        self.begin_tick(estimate.time)
        command = self._ask(estimate, target)
        wanted, limit = command.force.tolist(), self.parameters.thrust_limit
        force = self._blend(estimate.time, within(wanted, limit))
        self._note_fallback(estimate.time, command.fallback)
        self._force = np.array(force)
        return Thrust(estimate.time, self._force), Status(
            estimate.time,
            self.parameters.algorithm,
            command.force,
            [abs(value) > most for value, most in zip(wanted, limit, strict=True)],
            command.solver,
            command.iterations,
            command.cost,
            command.fallback,
        )

    @np.errstate(all="ignore")
    def _ask(self, estimate: NavigationState, target: Target) -> Command:
        """The law's answer, or no thrust with the reason when there is none to use."""
        state = estimate.relative_state.tolist()
        if not all(map(isfinite, state + target.relative_state.tolist())):
            name = "target" if all(map(isfinite, state)) else "estimate"
            return Command(np.zeros(3), fallback=f"{name} not finite: no thrust")
        if not 0.0 < estimate.mass < inf:
            reason = f"mass is {estimate.mass:g} kg; it must be positive and finite: no thrust"
            return Command(np.zeros(3), fallback=reason)
        try:
            command = self.configuration.design.command(estimate, target)
        except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
            return Command(np.zeros(3), fallback=f"{type(error).__name__}: {error}: no thrust")
        if not all(map(isfinite, command.force.tolist())):
            return Command(np.zeros(3), fallback="command not finite: no thrust")
        return command

    def _blend(self, time: int, wanted: list[float]) -> list[float]:
        """Bound the step at a hand-over, and give back what was withheld."""
        if self._predecessor is None and not any(self._withheld):
            return wanted
        limit = self.parameters.thrust_limit
        step = [self.parameters.handover_step * most for most in limit]
        if self._predecessor is not None:
            asked = _minus(wanted, self._force.tolist())
            self._withheld = _minus(asked, within(asked, step))
            flown = _newtons(_minus(asked, self._withheld))
            detail = f"from {self._predecessor}: step in force {_newtons(asked)} asked, {flown} flown"
            self.log(time, EventKind.HANDOVER, detail, self.parameters.algorithm)
            self._predecessor = None
        else:
            self._withheld = _minus(self._withheld, within(self._withheld, step))
        return within(_minus(wanted, self._withheld), limit)

    def _note_fallback(self, time: int, reason: str) -> None:
        """Record when a fallback begins, changes or ends."""
        if reason != self._fallback:
            self.log(time, EventKind.FALLBACK, reason or "over", self.parameters.algorithm)
            self._fallback = reason


def within(values: Sequence[float], limits: Sequence[float]) -> list[float]:
    """Each value, or the limit of its axis where it is beyond it."""
    return [min(max(value, -limit), limit) for value, limit in zip(values, limits, strict=True)]


def _minus(left: Sequence[float], right: Sequence[float]) -> list[float]:
    return [one - other for one, other in zip(left, right, strict=True)]


def _newtons(force: Sequence[float]) -> str:
    return "[" + ", ".join(f"{component:.3g}" for component in force) + "] N"
