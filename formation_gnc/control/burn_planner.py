"""When to burn: the planners of `impulsive`, near a circular chief and about any other."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.impulse_plan import (
    cross_track_impulse,
    in_plane_impulses,
    least_across,
    least_in_plane,
)
from formation_gnc.control.models import CLOSED_FORM_MODELS, check_along_track, near_circular_rates
from formation_gnc.control.optimal_burns import least_burns
from formation_gnc.control.thrust_response import QUARTERS
from formation_gnc.errors import OrbitError
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.chief import DISTINCT_PERIGEE
from formation_gnc.relative.relative_elements import near_circular_elements
from formation_gnc.types import NANOSECONDS, Matrix, Vector

LONGEST_BURN = 1.0 / 6.0
"""Of a burn, in revolutions: one of that length has 95 % of the effect of an impulse. The next plan does the rest."""

WORTH = 1e-2
"""Share of a plan's delta-v below which an impulse waits for a later plan: else it would stand before a large one."""


@dataclass(frozen=True)
class Burn:
    """A burn on one axis; times in s of the run."""

    begin: float
    end: float
    acceleration: float
    """m/s^2; constant."""


@dataclass(frozen=True)
class Thrusters:
    """What burns are made with."""

    limit: Vector
    """(3,) N."""
    minimum_impulse: float
    """N s."""
    tick: float
    """s"""

    def burn(self, axis: int, when: float, impulse: float, rate: float, estimate: NavigationState) -> Burn | None:
        """A burn centred on an impulse (m/s) at a time (s of the run), late ones from now; None if it is too small."""
        now, largest = estimate.time / NANOSECONDS, self.limit[axis] / estimate.mass
        if abs(impulse) <= max(self.minimum_impulse / estimate.mass, 1e-12 * rate):
            return None
        duration = min(abs(impulse) / largest, LONGEST_BURN * math.tau / rate)
        duration = max(duration, self.tick)
        level = math.copysign(min(abs(impulse) / duration, largest), impulse)
        begin = max(now, when - 0.5 * duration)
        return Burn(begin, begin + duration, level)


class BurnPlanner(ABC):
    """Begins the burns that are due."""

    @abstractmethod
    def begin(self, estimate: NavigationState, target: Target, burns: dict[int, Burn]) -> list[str]:
        """Add to the burns under way, by axis, those that are due in this tick; in words."""

    def reset(self) -> None:  # noqa: B027 - optional for planners that plan at every tick
        """Plan anew at the next tick."""

    @abstractmethod
    def figures(self) -> dict[str, Any]:
        """Design figures."""


class NearCircularBurns(BurnPlanner):
    """In closed form, along the track and across it apart."""

    def __init__(self, horizon: float, tolerance: float, thrusters: Thrusters, rates: tuple[float, ...]) -> None:
        """For a horizon in revolutions, a tolerance in m, and the rates of `near_circular_rates`."""
        self._horizon, self._tolerance, self._thrusters = math.tau * horizon, tolerance, thrusters
        self._rate, *self._phase_rates = rates

    def figures(self) -> dict[str, Any]:
        """Delta-v per metre of the elements."""
        return {
            "delta-v per metre of da or eccentricity vector [m/s]": 0.5 * self._rate,
            "delta-v per metre of inclination vector [m/s]": self._rate,
        }

    def begin(self, estimate: NavigationState, target: Target, burns: dict[int, Burn]) -> list[str]:
        """As the base."""
        elements = near_circular_elements(0.0, self._rate, estimate.relative_state - target.relative_state)
        found = [self._begin(axis, elements, estimate, burns) for axis in (1, 2) if axis not in burns]
        return [text for text in found if text]

    def _begin(self, axis: int, elements: Vector, estimate: NavigationState, burns: dict[int, Burn]) -> str:
        """Begin the burn of a plan on an axis if it is due in this tick; in words, empty if there is none."""
        if not self._thrusters.limit[axis] > 0.0:
            return ""
        horizon, rate = self._horizon, self._rate
        in_plane = axis == 1
        off = np.hypot(*elements[2:4]), np.abs(elements[:2]).max(), np.hypot(*elements[4:])
        if not (max(off[:2]) if in_plane else off[2]) > self._tolerance:
            return ""
        if in_plane:
            plan, least = in_plane_impulses(elements, rate, horizon), least_in_plane(elements, rate, horizon)
        else:
            plan, least = cross_track_impulse(elements, rate), least_across(elements, rate)
        burn = self._next_burn(axis, plan, estimate)
        if burn is None or burn.begin >= estimate.time / NANOSECONDS + self._thrusters.tick:
            return ""
        burns[axis] = burn
        name = "along the track" if in_plane else "across the track"
        return f"burn {name}: plan of {np.abs(plan[:, 1]).sum():.4g} m/s, least {least:.4g} m/s"

    def _next_burn(self, axis: int, plan: Matrix, estimate: NavigationState) -> Burn | None:
        """The first impulse of a plan that the thrusters can give, as a burn."""
        now = estimate.time / NANOSECONDS
        for angle, impulse in plan.tolist():
            when = now + angle / self._phase_rates[axis - 1]
            burn = self._thrusters.burn(axis, when, impulse, self._rate, estimate)
            if burn is not None:
                return burn
        return None


class OptimalBurns(BurnPlanner):
    """By the programme of `optimal_burns`, on all axes at once, with J2 where the chief has a node.

    A plan is made again at half of the time to its first burn, and so on until that is due; none while a burn is under
    way. With the first burn those of the plan begin that are due before it ends.
    """

    def __init__(self, horizon: float, tolerance: float, thrusters: Thrusters, common: CommonParameters) -> None:
        """For a horizon in revolutions and a tolerance in m."""
        self._horizon, self._tolerance, self._thrusters = horizon, tolerance, thrusters
        try:
            self._model = CLOSED_FORM_MODELS["relative_elements"](common)
        except OrbitError:
            self._model = CLOSED_FORM_MODELS["tschauner_hempel"](common)
        self._next = self._deadline = -math.inf
        """Time of the next plan, and that by which all burns of the first of its kind were to be made, s."""

    def reset(self) -> None:
        """As the base."""
        self._next = self._deadline = -math.inf

    def figures(self) -> dict[str, Any]:
        """Time of a plan."""
        return {"horizon [s]": self._horizon * self._model.period}

    def begin(self, estimate: NavigationState, target: Target, burns: dict[int, Burn]) -> list[str]:
        """As the base; raises ArithmeticError if the programme has no solution."""
        now, tick = estimate.time / NANOSECONDS, self._thrusters.tick
        if burns or now < self._next:
            return []
        model = self._model.anchored(estimate.chief_state, now)
        time = model.time_at(estimate.chief_state, now)
        own, aim = (model.averaged(estimate.chief_state, each.relative_state) for each in (estimate, target))
        ahead = model.transitions(time, model.period * QUARTERS)[:, :3] @ (own - aim)
        if not np.abs(ahead).max() > self._tolerance:
            return []
        horizon = self._horizon * model.period
        if now >= self._deadline:
            self._deadline = now + horizon
        plan = least_burns(model, time, own - aim, horizon, self._thrusters.limit, self._deadline - now)
        first: dict[int, Burn] = {}
        for when, impulse in zip(plan.times.tolist(), plan.impulses.tolist(), strict=True):
            for axis in {0, 1, 2} - first.keys():
                if abs(impulse[axis]) < WORTH * plan.delta_v:
                    continue
                burn = self._thrusters.burn(axis, now + when, impulse[axis], math.tau / model.period, estimate)
                if burn is not None:
                    first[axis] = burn
        begin = min((burn.begin for burn in first.values()), default=math.inf)
        if begin >= now + tick:
            self._next = now + max(tick, 0.5 * min(begin - now, model.period))
            return []
        end = min(burn.end for burn in first.values() if burn.begin == begin)
        burns |= {axis: first[axis] for axis in sorted(first) if first[axis].begin < end}
        return [f"burn: plan of {plan.delta_v:.4g} m/s, least {plan.least:.4g} m/s"]


def planner_of(
    horizon: float, tolerance: float, minimum_impulse: float, common: CommonParameters, vehicle: Vehicle
) -> BurnPlanner:
    """The planner for a chief; raises DesignError without thrust along the track."""
    thrusters = Thrusters(vehicle.thrust_limit, minimum_impulse, common.tick)
    check_along_track("impulsive", vehicle.thrust_limit)
    if common.chief.eccentricity >= DISTINCT_PERIGEE:
        return OptimalBurns(horizon, tolerance, thrusters, common)
    rates = near_circular_rates("impulsive", common, vehicle.thrust_limit)
    return NearCircularBurns(horizon, tolerance, thrusters, rates)
