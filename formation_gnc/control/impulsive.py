"""Impulsive control of the relative elements."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.burn_planner import Burn, planner_of
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.plan import held_over_tick
from formation_gnc.control.target_prediction import has_jumped
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class ImpulsiveParameters:
    """Horizon and tolerance of a plan, and the thrusters' least impulse."""

    horizon: float = parameter(
        1.5, minimum=1.5, maximum=5.0, in_flight=True, doc="time for a plan in revolutions: longer is cheaper"
    )
    tolerance: float = parameter(
        0.1,
        unit="m",
        above=0.0,
        in_flight=True,
        doc="error in da, dlambda, and the relative eccentricity and inclination vectors below which no burn is made; "
        "above the noise of the estimate",
    )
    minimum_impulse: float = parameter(
        0.0,
        follows="{deputy}.thrusters.minimum_impulse",
        unit="N s",
        minimum=0.0,
        doc="least impulse per axis and tick that the thrusters give; no smaller burn is made",
    )


class Impulsive(Controller[ImpulsiveParameters]):
    """Impulses that null the difference of the relative motion from the target's.

    Near a circular chief two or three burns along the track in the plane, and one across it, in closed form
    (`impulse_plan`; D'Amico 2010, Gaias and D'Amico 2015): the least delta-v for most changes of formation. About any
    other the burns of least delta-v on all axes, at times of their own, by a linear programme (`optimal_burns`). The
    status has the lower bound beside the plan. A burn is centred on its impulse and as long as the thrusters need, and
    is carried out once begun. Plans are made anew until one begins, and again when it has ended, so that errors of
    the burn, of the estimate and of the linear motion are made up by the burns that follow.

    Assumes: separation from the target much smaller than the radius; a target in free motion. The rates are the chief's
    under J2; a chief with a perigee and without a node has none.
    """

    Parameters = ImpulsiveParameters

    def __init__(self, parameters: ImpulsiveParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Choose the planner; raises DesignError without thrust along the track."""
        self._parameters, self._tick, self._limit = parameters, common.tick, vehicle.thrust_limit
        self._planner = planner_of(
            parameters.horizon, parameters.tolerance, parameters.minimum_impulse, common, vehicle
        )
        self._burns: dict[int, Burn] = {}
        """Under way, by axis."""
        self._target: Target | None = None

    def figures(self) -> dict[str, Any]:
        """Those of the planner."""
        return self._planner.figures()

    def activate(self, handover: Handover) -> None:
        """No burn of an earlier plan; one under way of the same law goes on."""
        self._burns = {}
        if isinstance(handover.law, Impulsive):
            self._burns, self._target = dict(handover.law._burns), handover.law._target

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The part of the burns under way that falls in this tick."""
        now = estimate.time / NANOSECONDS
        if has_jumped(self._target, target):
            self._burns = {}
            self._planner.reset()
        self._target = target
        self._burns = {axis: burn for axis, burn in self._burns.items() if burn.end > now}
        begun = self._planner.begin(estimate, target, self._burns)
        acceleration = np.zeros(3)
        for axis, burn in self._burns.items():
            share = max(0.0, min(burn.end, now + self._tick) - max(burn.begin, now)) / self._tick
            acceleration[axis] = share * burn.acceleration
        acceleration[np.abs(acceleration) * estimate.mass * self._tick < self._parameters.minimum_impulse] = 0.0
        steady = held_over_tick(acceleration, estimate.chief_state, self._tick) if acceleration.any() else acceleration
        force = estimate.mass * np.where(self._limit > 0.0, steady, 0.0)
        return Command(force, "; ".join(begun) or ("burning" if self._burns else "coasting"))
