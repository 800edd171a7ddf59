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
from formation_gnc.flight.mode import ModeInForce
from formation_gnc.flight.module import Configuration, FlightModule, ModuleParameters
from formation_gnc.mode_records import ModeState, RestrictionKind
from formation_gnc.parameters import change, parameter, per_entry
from formation_gnc.records import EventKind, NavigationState, Status, Target, Thrust
from formation_gnc.types import AXES


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
    released at that rate. Within the dead band, and in modes without a law, the law is not evaluated, and begins
    anew when these are left. The supervisor may have another law fly, which is designed at that tick, until it
    takes that back or the parameter `algorithm` is set.
    """

    def reset(self) -> None:
        """Clear the commanded force and the state of a handover."""
        self._force = np.zeros(3)
        self._predecessor: str | None = None
        self._withheld = [0.0, 0.0, 0.0]
        self._fallback = ""
        self._is_silent = False
        """Whether the law was silent at the tick before."""
        self._mode = ModeInForce()
        self._substitute: tuple[str, Controller[Any]] | None = None
        """Law that flies by restriction, with its name."""
        self._axes: list[int] = []
        """Indices of axes without thrust."""

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
        before = self._substitute
        if "algorithm" in new.changes:
            self._substitute = None
        if self._substitute is None:
            self._hand_over(before or (old.parameters.algorithm, old.design), new.design)

    @property
    def _law(self) -> tuple[str, Controller[Any]]:
        """The law in use, with its name."""
        return self._substitute or (self.parameters.algorithm, self.configuration.design)

    def _hand_over(self, before: tuple[str, Controller[Any]], law: Controller[Any]) -> None:
        self._predecessor = before[0]
        try:
            law.activate(Handover(self._force, *before))
        except Exception as error:  # a law may be a plug-in's
            self.log(self.time, EventKind.WARNING, f"takes over without the old law: {type(error).__name__}: {error}")

    def on_tick(
        self, estimate: NavigationState, target: Target, mode: ModeState | None = None
    ) -> tuple[Thrust, Status]:
        """Thrust for the tick that begins at the estimate's stamp, and the controller's status.

        mode: of the tick before; None for the one that stands.
        """
        self.begin_tick(estimate.time)
        if self._mode.take(mode):
            self._obey(estimate.time)
        command = self._evaluate(estimate, target)
        wanted, limit = command.force.tolist(), self.parameters.thrust_limit
        force = within(wanted, limit)
        if self._predecessor is not None or any(self._withheld):
            force = self._limit_step(estimate.time, force)
        for axis in self._axes:
            force[axis] = 0.0
        if command.fallback != self._fallback:
            self._record_fallback(estimate.time, command.fallback)
        self._force = command.force if force == wanted else np.array(force)
        return Thrust(estimate.time, self._force), Status(
            estimate.time,
            self._law[0],
            command.force,
            [abs(value) > largest for value, largest in zip(wanted, limit, strict=True)],
            command.solver,
            command.iterations,
            command.cost,
            command.fallback,
            self._mode.name,
        )

    def _obey(self, time: int) -> None:
        """Do without what the mode says, from a time (ns) on."""
        if self._mode.is_silent:
            self.log(time, EventKind.WARNING, f"the supervisor is silent: {self._mode.name} stands", "mode")
        self._axes = [AXES.index(each) for each in self._mode.without(RestrictionKind.AXIS) if each in AXES]
        laws = self._mode.without(RestrictionKind.LAW)
        if laws and self._substitute is None:
            self._substitute = self._first_of(time, laws)
            if self._substitute is not None:
                self._hand_over((self.parameters.algorithm, self.configuration.design), self._substitute[1])
        elif not laws and self._substitute is not None:
            before, self._substitute = self._substitute, None
            self._hand_over(before, self.configuration.design)

    def _first_of(self, time: int, laws: Sequence[str]) -> tuple[str, Controller[Any]] | None:
        """The first of some laws that is another than the one in use and can be designed."""
        for name in laws:
            if name == self.parameters.algorithm:
                continue
            try:
                return name, self.design(change(self.parameters, {"algorithm": name}))
            except ConfigurationError as error:
                self.log(time, EventKind.WARNING, f"cannot take over: {error}", name)
        return None

    @np.errstate(all="ignore")
    def _evaluate(self, estimate: NavigationState, target: Target) -> Command:
        """The law's command, or the mode's; zero thrust with the reason when input or output is unusable."""
        evasion = self._mode.evasion
        if evasion is not None:
            self._is_silent, self._withheld = True, [0.0, 0.0, 0.0]
            return Command(evasion, solver=f"mode {self._mode.name}")
        state = estimate.relative_state.tolist()
        if not all(map(isfinite, state + target.relative_state.tolist())):
            name = "target" if all(map(isfinite, state)) else "estimate"
            return Command(np.zeros(3), fallback=f"{name} not finite: no thrust")
        if not 0.0 < estimate.mass < inf:
            reason = f"mass is {estimate.mass:g} kg; it must be positive and finite: no thrust"
            return Command(np.zeros(3), fallback=reason)
        parameters, (name, law), was_silent = self.parameters, self._law, self._is_silent
        if was_silent or all(parameters.dead_band):
            error = (estimate.relative_state - target.relative_state).tolist()
            self._is_silent = is_tolerated(error, parameters.dead_band, parameters.mean_motion, was_silent)
            if self._is_silent:
                self._withheld = [0.0, 0.0, 0.0]
                return Command(np.zeros(3), solver="dead band")
        try:
            if was_silent:
                law.activate(Handover(np.zeros(3), name))
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
            self.log(time, EventKind.HANDOVER, detail, self._law[0])
            self._predecessor = None
        else:
            self._withheld = _minus(self._withheld, within(self._withheld, step))
        return within(_minus(wanted, self._withheld), limit)

    def _record_fallback(self, time: int, reason: str) -> None:
        """Record an event of a fallback that begins, changes or ends."""
        self.log(time, EventKind.FALLBACK, reason or "over", self._law[0])
        self._fallback = reason


def within(values: Sequence[float], limits: Sequence[float]) -> list[float]:
    """Each value clipped to plus or minus the limit of its axis."""
    return [min(max(value, -limit), limit) for value, limit in zip(values, limits, strict=True)]


def _minus(left: Sequence[float], right: Sequence[float]) -> list[float]:
    return [one - other for one, other in zip(left, right, strict=True)]


def _newtons(force: Sequence[float]) -> str:
    return "[" + ", ".join(f"{component:.3g}" for component in force) + "] N"
