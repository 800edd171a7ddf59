"""The active control law, its limits, and the swap from one law to another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

import numpy as np

from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.dead_band import is_tolerated
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError, DesignError, ParameterError
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters
from formation_gnc.parameters import parameter, per_entry
from formation_gnc.records import EventKind, NavigationState, Status, Target, Thrust


@dataclass(frozen=True)
class ControllerParameters(ModuleParameters):
    """Parameters of the controller node: those common to all laws, and each law's own under its name."""

    algorithm: str = parameter("lqr", choices=ALGORITHMS, in_flight=True, doc="active control law")
    mass: float = parameter(
        100.0, follows="{deputy}.mass", unit="kg", above=0.0, doc="initial mass of the deputy, for the design"
    )
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        follows="{deputy}.thrusters.limit",
        unit="N",
        length=3,
        minimum=0.0,
        doc="largest force per Hill axis",
    )
    handover_step: float = parameter(
        0.1,
        above=0.0,
        maximum=2.0,
        in_flight=True,
        doc="largest step in force when the law changes, as a share of thrust_limit; the rest of the change "
        "follows at one such step per tick",
    )
    dead_band: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0),
        unit="m",
        length=3,
        minimum=0.0,
        in_flight=True,
        doc="position error per Hill axis that is tolerated: no thrust from when free motion stays within it for a "
        "revolution until it is left; 0 on an axis for no dead band",
    )
    laws: Mapping[str, Any] = per_entry(ALGORITHMS)

    def __post_init__(self) -> None:
        """Raise ParameterError for a thrust limit of zero on every axis, unless no thrust is wanted."""
        super().__post_init__()
        if not any(self.thrust_limit) and self.algorithm != "coast":
            raise ParameterError(
                f"parameter thrust_limit: {list(self.thrust_limit)} is not allowed; "
                "one axis must push, or algorithm be coast"
            )


class ControllerManager(FlightModule[ControllerParameters, Controller[Any]]):
    """Evaluates the active law at every tick and enforces the limits.

    The thrust is finite and within its limit for any input and any output of the law; the status reports
    every intervention. When the law changes, the step in force beyond `handover_step` is withheld, then
    released at that rate. Within the dead band the law is not evaluated, and begins anew when it is left.
    """

    def reset(self) -> None:
        """Clear the commanded force and the state of a handover."""
        self._force = np.zeros(3)
        self._predecessor: str | None = None
        self._withheld = [0.0, 0.0, 0.0]
        self._fallback = ""
        self._is_silent = False
        """Whether the law was silent, within the dead band, at the tick before."""

    def design(self, parameters: ControllerParameters) -> Controller[Any]:
        """Design the law named by `algorithm`; raises DesignError as that law, whatever the law raises."""
        law = ALGORITHMS[parameters.algorithm]
        vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
        try:
            return law(parameters.laws[parameters.algorithm], parameters, vehicle)
        except ConfigurationError:
            raise
        except Exception as error:  # a law may be a plug-in's
            raise DesignError(f"{parameters.algorithm}: cannot be designed: {type(error).__name__}: {error}") from error

    def activate(
        self,
        old: Configuration[ControllerParameters, Controller[Any]],
        new: Configuration[ControllerParameters, Controller[Any]],
    ) -> None:
        """Hand the commanded force and the old law to the new law."""
        self._predecessor = old.parameters.algorithm
        new.design.activate(Handover(self._force, self._predecessor, old.design))

    def on_tick(self, estimate: NavigationState, target: Target) -> tuple[Thrust, Status]:
        """Thrust for the tick that begins at the estimate's stamp, and the controller's status."""
        self.begin_tick(estimate.time)
        command = self._evaluate(estimate, target)
        parameters = self.parameters
        wanted, limit = command.force.tolist(), parameters.thrust_limit
        force = within(wanted, limit)
        if self._predecessor is not None or any(self._withheld):
            force = self._limit_step(estimate.time, force)
        if command.fallback != self._fallback:
            self._record_fallback(estimate.time, command.fallback)
        self._force = command.force if force == wanted else np.array(force)
        return Thrust(estimate.time, self._force), Status(
            estimate.time,
            parameters.algorithm,
            command.force,
            [abs(value) > largest for value, largest in zip(wanted, limit, strict=True)],
            command.solver,
            command.iterations,
            command.cost,
            command.fallback,
        )

    @np.errstate(all="ignore")
    def _evaluate(self, estimate: NavigationState, target: Target) -> Command:
        """The law's command; zero thrust with the reason when input or output is unusable."""
        state = estimate.relative_state.tolist()
        if not all(map(isfinite, state + target.relative_state.tolist())):
            name = "target" if all(map(isfinite, state)) else "estimate"
            return Command(np.zeros(3), fallback=f"{name} not finite: no thrust")
        if not 0.0 < estimate.mass < inf:
            reason = f"mass is {estimate.mass:g} kg; it must be positive and finite: no thrust"
            return Command(np.zeros(3), fallback=reason)
        parameters, law, was_silent = self.parameters, self.configuration.design, self._is_silent
        if was_silent or all(parameters.dead_band):
            error = (estimate.relative_state - target.relative_state).tolist()
            self._is_silent = is_tolerated(error, parameters.dead_band, parameters.mean_motion, was_silent)
            if self._is_silent:
                self._withheld = [0.0, 0.0, 0.0]
                return Command(np.zeros(3), solver="dead band")
        try:
            if was_silent:
                law.activate(Handover(np.zeros(3), parameters.algorithm))
            command = law.command(estimate, target)
            wanted = command.force.tolist()
            is_finite = len(wanted) == 3 and all(map(isfinite, wanted))
        except Exception as error:  # a law may be a plug-in's: whatever it raises, the flight goes on
            return Command(np.zeros(3), fallback=f"{type(error).__name__}: {error}: no thrust")
        if not is_finite:
            return Command(np.zeros(3), fallback="command is not three finite forces: no thrust")
        return command

    def _limit_step(self, time: int, wanted: list[float]) -> list[float]:
        """Bound the step in force at a handover, and release what earlier handovers withheld."""
        limit = self.parameters.thrust_limit
        step = [self.parameters.handover_step * largest for largest in limit]
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

    def _record_fallback(self, time: int, reason: str) -> None:
        """Record an event of a fallback that begins, changes or ends."""
        self.log(time, EventKind.FALLBACK, reason or "over", self.parameters.algorithm)
        self._fallback = reason


def within(values: Sequence[float], limits: Sequence[float]) -> list[float]:
    """Each value clipped to plus or minus the limit of its axis."""
    return [min(max(value, -limit), limit) for value, limit in zip(values, limits, strict=True)]


def _minus(left: Sequence[float], right: Sequence[float]) -> list[float]:
    return [one - other for one, other in zip(left, right, strict=True)]


def _newtons(force: Sequence[float]) -> str:
    return "[" + ", ".join(f"{component:.3g}" for component in force) + "] N"
