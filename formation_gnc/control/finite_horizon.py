"""Base of the laws that complete a reconfiguration at a given final time."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.models import PLAN_MODELS
from formation_gnc.control.plan import Plan, Task, held_over_tick
from formation_gnc.control.target_prediction import has_jumped, target_after
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.orbit.elements import elements_from_state
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS, Matrix

MAX_STEPS = 500
"""Steps of the longest plan."""


@dataclass(frozen=True)
class FiniteHorizonParameters(QuadraticWeights):
    """Weights, model, final time and replanning schedule."""

    model: str = parameter(
        "oblate",
        choices=tuple(PLAN_MODELS),
        in_flight=True,
        doc="nonlinear relative motion of the plans: point-mass gravity, or with J2 (oblate)",
    )
    final_time: float = parameter(
        3000.0,
        unit="s",
        above=0.0,
        maximum=1e5,
        in_flight=True,
        doc="duration of a reconfiguration, from activation of the law or a jump of the target",
    )
    step: float = parameter(
        30.0, unit="s", above=0.0, in_flight=True, doc="longest step over which a plan holds its thrust"
    )
    replan_interval: float = parameter(
        120.0, unit="s", minimum=0.0, in_flight=True, doc="time between plans; 0 plans at every tick"
    )
    last_plan: float = parameter(
        600.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time to go below which no plan is made: a later one would respond to estimation noise",
    )
    terminal_error: float = parameter(
        0.0,
        minimum=0.0,
        in_flight=True,
        doc="terminal error, in units of the weights, that costs as much as `thrust` over the whole "
        "reconfiguration; 0 for a hard terminal constraint",
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "linear", "nonlinear"),
        in_flight=True,
        doc="as lqr.feed_forward, for the LQR that holds the target afterwards",
    )


@dataclass
class _Reconfiguration:
    """Progress of a reconfiguration; times in ns of the run."""

    began_at: int
    plan: Plan | None = None
    """The plan in force."""
    planned_at: int = 0
    """Start of the plan in force."""
    attempted_at: int | None = None
    """Time of the latest planning attempt."""
    failure: str = ""
    """Why that attempt failed."""


class FiniteHorizonController[P: FiniteHorizonParameters](Controller[P]):
    """Reconfigures to a moving target in a given time, then holds the target.

    A reconfiguration begins at activation and at every jump of the target; a change of the law's own
    parameters continues the current one. The goal is the predicted target at the final time (`target_after`).
    A plan is computed from the current estimate at the start and every `replan_interval`, until `last_plan`
    before the final time. Afterwards, and while there is no plan, an LQR on Hill's equations with the same
    weights is active.

    A plan is rejected if it is not finite, exceeds the thrust limit or reports a failure. The previous plan
    then continues, or LQR if there is none, and the command gives the reason.

    A subclass implements `plan`, a pure function of the task with bounded iterations; its `Parameters`
    extend `FiniteHorizonParameters`.
    """

    def __init__(self, parameters: P, common: CommonParameters, vehicle: Vehicle) -> None:
        """Scale the cost and design the holding LQR.

        Raises:
            DesignError: more than `MAX_STEPS` steps, or weights inadmissible for LQR.
        """
        self.parameters = parameters
        self._tick = common.tick
        self._limit = vehicle.thrust_limit
        if parameters.final_time > MAX_STEPS * parameters.step:
            raise DesignError(
                f"final_time is {parameters.final_time} s in steps of {parameters.step} s; "
                f"it must be at most {MAX_STEPS} steps"
            )
        holding = LqrParameters(feed_forward=parameters.feed_forward, **parameters.weights())
        self.holding = LinearQuadraticRegulator(holding, common, vehicle)
        self._effort = vehicle.mass**2 * parameters.thrust_matrix() / parameters.final_time
        self._effort[np.diag_indices(3)] += np.where(vehicle.thrust_limit > 0.0, 0.0, np.inf)
        self._slack: Matrix = np.zeros((6, 6))
        if parameters.terminal_error > 0.0:
            self._slack = np.asarray(parameters.terminal_error**2 * np.linalg.pinv(parameters.state_matrix()))
        self._current: _Reconfiguration | None = None
        self._target: Target | None = None

    @abstractmethod
    def plan(self, task: Task) -> Plan:
        """The thrust history that solves the task; must not depend on anything else.

        Infeasibility is reported in the plan's `failure`; arithmetic errors may be raised.
        """

    def figures(self) -> dict[str, Any]:
        """Size and number of plans, and the figures of the holding LQR."""
        parameters = self.parameters
        interval = max(parameters.replan_interval, self._tick)
        later = max(0.0, parameters.final_time - parameters.last_plan) / interval
        return {
            "steps of the first plan": math.ceil(parameters.final_time / parameters.step),
            "plans in a reconfiguration": max(1, math.ceil(later)),
            **self.holding.figures(),
        }

    def activate(self, handover: Handover) -> None:
        """Continue the reconfiguration of a law of the same class, or begin one."""
        self._current = None
        if type(handover.law) is type(self):
            self._current, self._target = handover.law._current, handover.law._target

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The plan's mean force over this tick, as the plant holds it, or that of the holding LQR."""
        if self._current is None or has_jumped(self._target, target):
            self._current = _Reconfiguration(estimate.time)
        self._target = target
        current = self._current
        to_go = self.parameters.final_time - (estimate.time - current.began_at) / NANOSECONDS
        new = self._replan(current, estimate, target, to_go) if self._is_due(current, estimate.time, to_go) else None
        since = (estimate.time - current.planned_at) / NANOSECONDS
        if current.plan is None or to_go <= 0.0:
            held = self.holding.command(estimate, target)
            failure = current.failure if current.plan is None else ""
            if current.plan is not None and current.plan.duration - since > self._tick:
                failure = f"final_time is past by {-to_go:g} s"
            reason = f"{failure}; LQR active" if failure else held.fallback
            return Command(held.force, "holding", new.iterations if new else 0, 0.0, reason)
        planned = current.plan.mean(since, since + self._tick)
        steady = held_over_tick(planned, estimate.chief_state, self._tick)
        force = estimate.mass * np.where(self._limit > 0.0, steady, 0.0)
        reason = f"{current.failure}; previous plan continues" if current.failure else ""
        if new is None:
            return Command(force, "following", fallback=reason)
        return Command(force, "planned" if new is current.plan else "failed", new.iterations, new.cost, reason)

    def _is_due(self, current: _Reconfiguration, time: int, to_go: float) -> bool:
        """Whether to plan at this tick."""
        if current.attempted_at is None:
            return to_go > 0.0
        waited = (time - current.attempted_at) / NANOSECONDS
        return bool(waited >= self.parameters.replan_interval and to_go > self.parameters.last_plan)

    def _replan(self, current: _Reconfiguration, estimate: NavigationState, target: Target, to_go: float) -> Plan:
        """A new plan, put in force if it is valid."""
        current.attempted_at = estimate.time
        new = self._checked_plan(current, estimate, target, to_go)
        current.failure = new.failure
        if not new.failure:
            current.plan, current.planned_at = new, estimate.time
        return new

    def _checked_plan(self, current: _Reconfiguration, estimate: NavigationState, target: Target, to_go: float) -> Plan:
        """A plan for the time to go, with its `failure` set if it must not be used."""
        zero = np.zeros((1, 3))
        steps = max(1, math.ceil(to_go / self.parameters.step - 1e-9))
        if steps > MAX_STEPS:
            return Plan(zero, to_go, 0, f"{steps} steps to plan, at most {MAX_STEPS} allowed")
        try:
            plan = self.plan(self._task(current, estimate, target, to_go, steps))
        except ConfigurationError as error:
            return Plan(zero, to_go, 0, f"no plan: {error}")
        except (ArithmeticError, LinAlgError, ValueError) as error:
            return Plan(zero, to_go, 0, f"no plan: {type(error).__name__}: {error}")
        if plan.failure:
            return Plan(zero, to_go, plan.iterations, f"no plan: {plan.failure}")
        if not np.isfinite(plan.acceleration).all():
            return Plan(zero, to_go, plan.iterations, "no plan: it is not finite")
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            asked = np.nanmax(estimate.mass * np.abs(plan.acceleration).max(axis=0) / self._limit)
        if not asked <= 1.0:
            failure = f"no plan: final_time is too short: {asked:.3g} times the thrust limit is required"
            return Plan(zero, to_go, plan.iterations, failure)
        return plan

    def _task(
        self, current: _Reconfiguration, estimate: NavigationState, target: Target, to_go: float, steps: int
    ) -> Task:
        """The remaining two-point problem, with the rest of the plan in force as initial guess."""
        guess = None
        if current.plan is not None:
            ends = (estimate.time - current.planned_at) / NANOSECONDS + np.linspace(0.0, to_go, steps + 1)
            guess = current.plan.mean(ends[:-1], ends[1:])
        model = PLAN_MODELS[self.parameters.model](elements_from_state(estimate.chief_state))
        goal = target_after(target, to_go, model)
        return Task(model, 0.0, estimate.relative_state, goal, to_go, steps, guess, self._effort, self._slack)
