"""What every law has in common that flies a reconfiguration in a given time."""

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.model import RelativeModel, integrate
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

PLAN_MODELS: dict[str, Callable[[Elements], RelativeModel]] = {
    "nonlinear": lambda chief: NonlinearModel(KeplerChief.of(chief)),
    "oblate": lambda chief: OblateModel(OblateChief(chief)),
}
"""The nonlinear models that a plan can be made on, by name; their time zero is that of the elements."""

MOST_STEPS = 500
"""Steps of the longest plan."""

LEAP = 0.1
"""Distance (m) off a smooth path from which a target counts as another one."""

SHARE_OF_PATH = 0.01
"""The same as a share of the way since the target before: what a smooth path may bend in a long tick."""


COARSE = 8
"""Integration step for the target's free flight, in those for rounding error: 10^-8 of the distance at order
eight."""


@dataclass(frozen=True)
class Task:
    """A reconfiguration that is to be planned."""

    model: RelativeModel
    """The equations of motion."""
    time: float
    """Now, s, in the model's time."""
    state: Vector
    """(6,) relative state now, Hill frame, m and m/s."""
    goal: Vector
    """(6,) relative state to have at the final time."""
    duration: float
    """Time to go until then, s."""
    steps: int
    """Number of equal steps over which the plan holds its thrust."""
    guess: Matrix | None = None
    """(steps, 3) what is left of the plan before, m/s^2; none for the first."""
    effort: Matrix = field(default_factory=lambda: np.eye(3))
    """(3, 3) weight R: the plan minimises the integral of a' R a over the acceleration, infinite on an axis
    that does not push ..."""
    slack: Matrix = field(default_factory=lambda: np.zeros((6, 6)))
    """(6, 6) ... plus e' S^-1 e of the error at the final time; zero allows none."""

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return self.duration / self.steps


@dataclass(frozen=True)
class Plan:
    """A thrust history, and how it came about."""

    acceleration: Matrix
    """(N, 3) held over N equal steps, Hill frame, m/s^2."""
    duration: float
    """Length of them all, s."""
    iterations: int = 1
    failure: str = ""
    """Why it is not to be flown; empty for a plan that is."""

    @property
    def cost(self) -> float:
        """Integral of the squared acceleration, m^2/s^3."""
        return float(np.sum(self.acceleration**2)) * self.duration / len(self.acceleration)

    def mean(self, begin: Vector | float, end: Vector | float) -> Matrix:
        """Mean acceleration (..., 3) between two times since the plan's begin, s; none after its end."""
        knots = np.linspace(0.0, self.duration, len(self.acceleration) + 1)
        step = self.duration / len(self.acceleration)
        impulse = np.vstack([np.zeros(3), np.cumsum(self.acceleration, axis=0) * step])
        moved = [np.interp(end, knots, axis) - np.interp(begin, knots, axis) for axis in impulse.T]
        mean: Matrix = np.stack(moved, axis=-1) / np.asarray(np.subtract(end, begin))[..., None]
        return mean


@dataclass(frozen=True)
class FiniteHorizonParameters(QuadraticWeights):
    """Weights, model, time and schedule of plans."""

    model: str = parameter(
        "oblate",
        choices=tuple(PLAN_MODELS),
        in_flight=True,
        doc="exact relative motion that plans are made on: of point masses, or with J2 (oblate)",
    )
    final_time: float = parameter(
        3000.0,
        unit="s",
        above=0.0,
        maximum=1e5,
        in_flight=True,
        doc="time of a reconfiguration, from where the law takes over or the target leaps",
    )
    step: float = parameter(
        30.0, unit="s", above=0.0, in_flight=True, doc="longest step over which a plan holds its thrust"
    )
    replan_interval: float = parameter(
        120.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time for which one plan is flown; 0 plans at every tick",
    )
    last_plan: float = parameter(
        600.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time to go at which the last plan is made: later ones would answer the estimate's noise",
    )
    terminal_error: float = parameter(
        0.0,
        minimum=0.0,
        in_flight=True,
        doc="error at the final time, in sizes that weigh one, that costs as much as `thrust` all the way; 0 "
        "allows none",
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "linear", "nonlinear"),
        in_flight=True,
        doc="as lqr.feed_forward, for the law that holds the target afterwards",
    )


@dataclass
class _Flight:
    """The reconfiguration under way."""

    begin: int
    """When it began, ns."""
    plan: Plan | None = None
    """The plan in force."""
    planned_at: int = 0
    """When it was made, ns."""
    tried_at: int | None = None
    """When a plan was last tried, ns."""
    failure: str = ""
    """Why that one does not count."""


class FiniteHorizonController(Controller):
    """Flies a reconfiguration to a moving target in a given time, then holds the target.

    A reconfiguration begins when the law takes over and whenever the target leaps: when it is off the smooth
    path from the target before by more than `LEAP` and `SHARE_OF_PATH`. A change of the law's own parameters
    is no begin. The goal is where the target is at the final time: in the preview as far as that goes, and
    in free flight from its end. The law plans at the begin and, until `last_plan` before the final time,
    every `replan_interval`, from the estimate as it is then. Afterwards, and whenever there is no plan, LQR
    on Hill's equations flies, on the same weights.

    A plan does not count that is not finite, asks more than the thrust limit or says itself that it failed.
    Then the plan before flies on, or LQR when there is none, and the command says why.

    Subclasses give `plan`, a pure function of the task with a bound on its iterations, and `Parameters`, a
    subclass of `FiniteHorizonParameters`.
    """

    def __init__(self, parameters: Any, common: CommonParameters, vehicle: Vehicle) -> None:
        """Design the law that holds.

        Raises:
            DesignError: a plan of too many steps, or weights that LQR cannot take.
        """
        self._parameters = parameters
        self._tick = common.tick
        self._limit = vehicle.thrust_limit
        if parameters.final_time > MOST_STEPS * parameters.step:
            raise DesignError(
                f"final_time is {parameters.final_time} s in steps of {parameters.step} s; "
                f"it must be at most {MOST_STEPS} steps"
            )
        holding = LqrParameters(feed_forward=parameters.feed_forward, **parameters.weights())
        self.holding = LinearQuadraticRegulator(holding, common, vehicle)
        self._effort = vehicle.mass**2 * parameters.thrust_matrix() / parameters.final_time
        self._effort[np.diag_indices(3)] += np.where(vehicle.thrust_limit > 0.0, 0.0, np.inf)
        self._slack = np.zeros((6, 6))
        if parameters.terminal_error > 0.0:
            self._slack = parameters.terminal_error**2 * np.linalg.pinv(parameters.state_matrix())
        self._flight: _Flight | None = None
        self._target: Target | None = None

    @abstractmethod
    def plan(self, task: Task) -> Plan:
        """The thrust that takes a state to the goal in time: a pure function of the task.

        A plan that cannot be made says why in its `failure`; errors of arithmetic may be raised.
        """

    def figures(self) -> dict[str, Any]:
        """The schedule of plans, and the law that holds."""
        parameters = self._parameters
        interval = max(parameters.replan_interval, self._tick)
        later = max(0.0, parameters.final_time - parameters.last_plan) / interval
        return {
            "steps of the first plan": math.ceil(parameters.final_time / parameters.step),
            "plans in a reconfiguration": max(1, math.ceil(later)),
            **self.holding.figures(),
        }

    def activate(self, handover: Handover) -> None:
        """Go on with the reconfiguration of the same law with other parameters."""
        if type(handover.law) is type(self):
            self._flight, self._target = handover.law._flight, handover.law._target

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force of the plan in force for this tick, or of the law that holds."""
        if self._flight is None or leaps(self._target, target):
            self._flight = _Flight(estimate.time)
        self._target = target
        flight = self._flight
        to_go = self._parameters.final_time - (estimate.time - flight.begin) / NANOSECONDS
        new = self._try(flight, estimate, target, to_go) if self._is_due(flight, estimate.time, to_go) else None
        since = (estimate.time - flight.planned_at) / NANOSECONDS
        if flight.plan is None or to_go <= 0.0:
            held = self.holding.command(estimate, target)
            failure = flight.failure if flight.plan is None else ""
            if flight.plan is not None and flight.plan.duration - since > self._tick:
                failure = f"final_time is past by {-to_go:g} s"
            reason = f"{failure}; LQR flies" if failure else held.fallback
            return Command(held.force, "holding", new.iterations if new else 0, 0.0, reason)
        force = estimate.mass * flight.plan.mean(since, since + self._tick)
        reason = f"{flight.failure}; the plan before flies on" if flight.failure else ""
        if new is None:
            return Command(force, "following", fallback=reason)
        return Command(force, "planned" if new is flight.plan else "failed", new.iterations, new.cost, reason)

    def _is_due(self, flight: _Flight, time: int, to_go: float) -> bool:
        """Whether to plan at this tick."""
        if flight.tried_at is None:
            return to_go > 0.0
        waited = (time - flight.tried_at) / NANOSECONDS
        return bool(waited >= self._parameters.replan_interval and to_go > self._parameters.last_plan)

    def _try(self, flight: _Flight, estimate: NavigationState, target: Target, to_go: float) -> Plan:
        """Plan anew, and put the plan in force if it counts."""
        flight.tried_at = estimate.time
        new = self._answer(flight, estimate, target, to_go)
        flight.failure = new.failure
        if not new.failure:
            flight.plan, flight.planned_at = new, estimate.time
        return new

    def _answer(self, flight: _Flight, estimate: NavigationState, target: Target, to_go: float) -> Plan:
        """A plan for what is left, with its failure named."""
        nothing = np.zeros((1, 3))
        steps = max(1, math.ceil(to_go / self._parameters.step - 1e-9))
        if steps > MOST_STEPS:
            return Plan(nothing, to_go, 0, f"{steps} steps to plan, at most {MOST_STEPS} allowed")
        guess = None
        if flight.plan is not None:
            ends = (estimate.time - flight.planned_at) / NANOSECONDS + np.linspace(0.0, to_go, steps + 1)
            guess = flight.plan.mean(ends[:-1], ends[1:])
        try:
            model = PLAN_MODELS[self._parameters.model](elements_from_state(estimate.chief_state))
            goal = target_after(target, to_go, model)
            plan = self.plan(
                Task(model, 0.0, estimate.relative_state, goal, to_go, steps, guess, self._effort, self._slack)
            )
        except ConfigurationError as error:
            return Plan(nothing, to_go, 0, f"no plan: {error}")
        except (ArithmeticError, LinAlgError, ValueError) as error:
            return Plan(nothing, to_go, 0, f"no plan: {type(error).__name__}: {error}")
        if plan.failure:
            return Plan(nothing, to_go, plan.iterations, f"no plan: {plan.failure}")
        if not np.isfinite(plan.acceleration).all():
            return Plan(nothing, to_go, plan.iterations, "no plan: it is not finite")
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            asked = np.nanmax(estimate.mass * np.abs(plan.acceleration).max(axis=0) / self._limit)
        if not asked <= 1.0:
            failure = f"no plan: final_time is too short: {asked:.3g} times the thrust limit is asked"
            return Plan(nothing, to_go, plan.iterations, failure)
        return plan


def leaps(before: Target | None, target: Target) -> bool:
    """Whether a target is off the smooth path from the one before."""
    if before is None:
        return False
    elapsed = (target.time - before.time) / NANOSECONDS
    moved = target.relative_state[:3] - before.relative_state[:3]
    smooth = 0.5 * elapsed * (before.relative_state[3:] + target.relative_state[3:])
    off = float(np.linalg.norm(moved - smooth))
    return off > max(LEAP, SHARE_OF_PATH * float(np.linalg.norm(moved)))


def target_after(target: Target, duration: float, model: RelativeModel) -> Vector:
    """(6,) target state after a duration (s): of the preview, and in free flight from its end.

    Between two states of the preview it is the cubic through their positions and velocities. The model's time
    zero is the target's.
    """
    step, count = target.preview_step / NANOSECONDS, len(target.preview)
    knots = np.vstack([target.relative_state[None], target.preview.reshape(-1, 6)])
    index = min(int(duration / step), count) if count else 0
    rest = duration - index * step
    if index == count:
        begin = index * step if count else 0.0
        return integrate(
            lambda time, state: model.motion(time, state)[0],
            begin,
            knots[-1],
            rest,
            COARSE * model.longest_step,
        )
    s = rest / step
    here, there = knots[index], knots[index + 1]
    slopes = step * here[3:], step * there[3:]
    across = here[:3] - there[:3]
    place = here[:3] + s * slopes[0] - s**2 * (3.0 * across + 2.0 * slopes[0] + slopes[1])
    place += s**3 * (2.0 * across + slopes[0] + slopes[1])
    rate = slopes[0] - 2.0 * s * (3.0 * across + 2.0 * slopes[0] + slopes[1])
    rate += 3.0 * s**2 * (2.0 * across + slopes[0] + slopes[1])
    return np.concatenate([place, rate / step])
