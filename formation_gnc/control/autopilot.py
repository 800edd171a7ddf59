"""The control law in use, its limits, and the swap from one law to another."""

from dataclasses import dataclass, make_dataclass
from typing import Any

import numpy as np

from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.interface import Estimate, Status, Target, Thrust
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

    A command is finite and within the limit whatever the law returns; what had to be changed is in the
    status.
    """

    def __init__(self, name: str, parameters: Any) -> None:
        """Design the law that `parameters.algorithm` names; raises ConfigurationError when it cannot be."""
        super().__init__(name, parameters)
        self._force = np.zeros(3)
        self._limit = np.array(parameters.thrust_limit)

    def design(self, parameters: Any) -> Controller:
        """Design the named law from its own parameters."""
        law = ALGORITHMS[parameters.algorithm]
        vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
        return law(getattr(parameters, parameters.algorithm), parameters, vehicle)

    def take_over(self, old: Configuration[Any, Controller], new: Configuration[Any, Controller]) -> None:
        """Tell the new law what flew before."""
        new.design.take_over(Handover(self._force, old.parameters.algorithm, old.design))

    def on_tick(self, estimate: Estimate, target: Target) -> tuple[Thrust, Status]:
        """The command for the tick that begins at the estimate's stamp, and how it came about."""
        self.begin_tick(estimate.time)
        command = self.configuration.design.command(estimate, target)
        if not np.isfinite(command.force).all():
            command = Command(np.zeros(3), fallback="command not finite: no thrust")
        if command.fallback:
            self.record(estimate.time, "fallback", command.fallback)
        force = np.clip(command.force, -self._limit, self._limit)
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
