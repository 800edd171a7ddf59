"""Impulsive control of the relative elements."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.impulse_plan import (
    cross_track_impulse,
    in_plane_impulses,
    least_across,
    least_in_plane,
)
from formation_gnc.control.models import near_circular_rates
from formation_gnc.control.plan import held_over_tick
from formation_gnc.control.target_prediction import has_jumped
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.relative_elements import near_circular_elements
from formation_gnc.types import NANOSECONDS, Matrix, Vector

LONGEST_BURN = 1.0 / 6.0
"""Of a burn, in revolutions: one of that length has 95 % of the effect of an impulse. The next plan does the rest."""


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


@dataclass(frozen=True)
class _Burn:
    """A burn on one axis; times in s of the run."""

    begin: float
    end: float
    acceleration: float
    """m/s^2; constant."""


class Impulsive(Controller[ImpulsiveParameters]):
    """Impulses that null the difference of the relative elements from the target's, near a circular chief.

    In the plane two or three burns along the track, and one across it, in closed form (`impulse_plan`; D'Amico 2010,
    Gaias and D'Amico 2015): the least delta-v for most changes of formation, beside which the status has the lower
    bound. A burn is centred on its impulse and as long as the thrusters need, and is carried out once begun. Plans are
    made anew from every estimate until one begins, and again when it has ended, so that errors of the burn, of the
    estimate and of the linear elements are made up by the burns that follow.

    Assumes: near-circular chief; separation from the target much smaller than the radius; a target in free motion. The
    rates are the chief's under J2.
    """

    Parameters = ImpulsiveParameters

    def __init__(self, parameters: ImpulsiveParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Take the rates of the chief.

        Raises:
            DesignError: an eccentric chief, or no thrust along the track.
        """
        self._parameters, self._tick, self._limit = parameters, common.tick, vehicle.thrust_limit
        self._rate, *self._phase_rates = near_circular_rates("impulsive", common, vehicle.thrust_limit)
        self._burns: dict[int, _Burn] = {}
        """Under way, by axis."""
        self._target: Target | None = None

    def figures(self) -> dict[str, Any]:
        """Delta-v per metre of the elements."""
        return {
            "delta-v per metre of da or eccentricity vector [m/s]": 0.5 * self._rate,
            "delta-v per metre of inclination vector [m/s]": self._rate,
        }

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
        self._target = target
        self._burns = {axis: burn for axis, burn in self._burns.items() if burn.end > now}
        elements = near_circular_elements(0.0, self._rate, estimate.relative_state - target.relative_state)
        begun = [text for axis in (1, 2) if axis not in self._burns and (text := self._begin(axis, elements, estimate))]
        acceleration = np.zeros(3)
        for axis, burn in self._burns.items():
            share = max(0.0, min(burn.end, now + self._tick) - max(burn.begin, now)) / self._tick
            acceleration[axis] = share * burn.acceleration
        acceleration[np.abs(acceleration) * estimate.mass * self._tick < self._parameters.minimum_impulse] = 0.0
        steady = held_over_tick(acceleration, estimate.chief_state, self._tick) if acceleration.any() else acceleration
        force = estimate.mass * np.where(self._limit > 0.0, steady, 0.0)
        return Command(force, "; ".join(begun) or ("burning" if self._burns else "coasting"))

    def _begin(self, axis: int, elements: Vector, estimate: NavigationState) -> str:
        """Begin the burn of a plan on an axis if it is due in this tick; in words, empty if there is none."""
        if not self._limit[axis] > 0.0:
            return ""
        horizon, rate = math.tau * self._parameters.horizon, self._rate
        in_plane = axis == 1
        off = np.hypot(*elements[2:4]), np.abs(elements[:2]).max(), np.hypot(*elements[4:])
        if not (max(off[:2]) if in_plane else off[2]) > self._parameters.tolerance:
            return ""
        if in_plane:
            plan, least = in_plane_impulses(elements, rate, horizon), least_in_plane(elements, rate, horizon)
        else:
            plan, least = cross_track_impulse(elements, rate), least_across(elements, rate)
        burn = self._next_burn(axis, plan, estimate)
        if burn is None or burn.begin >= estimate.time / NANOSECONDS + self._tick:
            return ""
        self._burns[axis] = burn
        name = "along the track" if in_plane else "across the track"
        return f"burn {name}: plan of {np.abs(plan[:, 1]).sum():.4g} m/s, least {least:.4g} m/s"

    def _next_burn(self, axis: int, plan: Matrix, estimate: NavigationState) -> _Burn | None:
        """The first impulse of a plan that the thrusters can give, as a burn; one that is late begins now."""
        now, largest = estimate.time / NANOSECONDS, self._limit[axis] / estimate.mass
        least = max(self._parameters.minimum_impulse / estimate.mass, 1e-12 * self._rate)
        for angle, impulse in plan.tolist():
            if abs(impulse) <= least:
                continue
            duration = min(abs(impulse) / largest, LONGEST_BURN * math.tau / self._rate)
            duration = max(duration, self._tick)
            level = math.copysign(min(abs(impulse) / duration, largest), impulse)
            begin = max(now, now + angle / self._phase_rates[axis - 1] - 0.5 * duration)
            return _Burn(begin, begin + duration, level)
        return None
