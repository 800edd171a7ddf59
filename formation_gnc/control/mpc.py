"""Model predictive control (MPC)."""

from dataclasses import dataclass, replace
from math import asin, sqrt
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.condensed_qp import CondensedQp, PlanCost, condense_along_orbit
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.linear import LinearController
from formation_gnc.control.lqr import ORBIT_INTERVALS, LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.mpc_constraints import (
    Constraint,
    KeepOutSpheres,
    PlanInputs,
    ThrustBox,
    ThrustMagnitude,
    ThrustRate,
    TotalThrust,
)
from formation_gnc.control.plan_solver import PlanSolver, SolverError
from formation_gnc.control.riccati import Weights, periodic_cost_to_go
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import DesignError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS, Vector

MAX_ERROR = 1e12
"""Error (m) beyond which no plan is made: products would overflow."""

KEEP_OUT_WEIGHT = 1e4
"""Cost of violating a keep-out sphere by one `position_error`, relative to the unit cost of that error."""


@dataclass(frozen=True)
class MpcParameters(QuadraticWeights):
    """Weights, horizon and constraints."""

    model: str = parameter(
        "hill", choices=tuple(DESIGN_MODELS), in_flight=True, doc="relative-motion model of the prediction"
    )
    step: float = parameter(60.0, unit="s", above=0.0, in_flight=True, doc="step of the plan; a multiple of the tick")
    horizon: int = parameter(30, minimum=1, maximum=500, in_flight=True, doc="prediction horizon, steps")
    control_horizon: int = parameter(
        0, minimum=0, maximum=500, in_flight=True, doc="steps with thrust, zero after them; 0 for the whole horizon"
    )
    replan_interval: float = parameter(
        0.0, unit="s", minimum=0.0, in_flight=True, doc="time between plans; 0 plans at every tick"
    )
    weighting: str = parameter(
        "running",
        choices=("running", "terminal"),
        in_flight=True,
        doc="running: the error at all steps, with the cost-to-go of LQR as terminal cost, and thrust per tick; "
        "terminal: only the error at the end of the horizon, and thrust per step (Kremmydas)",
    )
    cost: str = parameter(
        "quadratic", choices=("quadratic", "absolute"), in_flight=True, doc="cost of thrust; absolute is delta-v"
    )
    total_thrust: float = parameter(
        0.0,
        follows="{deputy}.thrusters.total_limit",
        unit="N",
        minimum=0.0,
        in_flight=True,
        doc="limit on the magnitude of the force, by an inscribed polyhedron; 0 for none",
    )
    thrust_rate: float = parameter(
        0.0, unit="N/s", minimum=0.0, in_flight=True, doc="limit on the rate of the force per axis; 0 for none"
    )
    keep_out_radius: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="radius of a soft keep-out sphere about each of the other satellites; 0 for none",
    )
    keep_out_chief: bool = parameter(True, in_flight=True, doc="whether the chief has a keep-out sphere too")
    off_in_eclipse: bool = parameter(
        False,
        follows="{deputy}.thrusters.off_in_eclipse",
        in_flight=True,
        doc="no thrust in the eclipses that the target predicts, nor in a step of the plan that meets one",
    )


class ModelPredictiveController(Controller[MpcParameters]):
    """MPC with linear prediction: a QP in the forces over a horizon, under the active constraints.

    Running weights: the discrete LQR's stage cost over the horizon, then its cost-to-go, so that the law equals
    that LQR while no constraint is active. Terminal weights (Kremmydas 4.3): only the error at the end of the
    horizon, from the target propagated there. The target follows its preview as far as that reaches on the
    plan's steps, then free motion. With `replan_interval` one plan is applied for that time (multistep);
    without, a plan is computed at every tick (receding horizon).

    The states are eliminated (condensed QP): measured to be twice as fast as the sparse form. For a model that
    varies along the orbit, the QP is tabulated every two degrees.

    Without a solution the previous plan continues; beyond its end an LQR with the same weights is active. The
    command gives the reason.

    Assumes: separation much smaller than the chief's radius; the model's assumptions; a mass close to the
    design's.
    """

    Parameters = MpcParameters

    def __init__(self, parameters: MpcParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Tabulate the QP and set up the solver.

        Raises:
            DesignError: a step that is no multiple of the tick, a control horizon beyond the horizon or shorter
                than an eclipse, or no LQR.
        """
        self._parameters = parameters
        self._tick_ns, self._step_ns = common.tick_ns, round(parameters.step * NANOSECONDS)
        self._replan_ns = max(round(parameters.replan_interval * NANOSECONDS), 1)
        self._steps = parameters.control_horizon or parameters.horizon
        self._check_horizons(common)
        self._model = DESIGN_MODELS[parameters.model](common)
        self.limit, self._mass = vehicle.thrust_limit, vehicle.mass
        """(3,) largest force of a plan per axis, N."""
        if parameters.total_thrust > 0.0:
            self.limit = np.minimum(self.limit, parameters.total_thrust)
        self.unit = float(self.limit.max())
        """N; unit of the forces in the QP."""
        gain = "discrete" if self._model.is_time_invariant else "periodic"
        try:
            self.fallback_law = LinearQuadraticRegulator(
                LqrParameters(model=parameters.model, gain=gain, **parameters.weights()), common, vehicle
            )
        except DesignError as error:
            raise DesignError(f"mpc: fallback law: {error}") from error
        self._effort = parameters.effort(vehicle)
        self.plan = np.empty((0, 3))
        """(M, 3) forces of the plan in force, N, held over its steps; empty before the first plan."""
        self._planned_at = 0
        self.qps = self._tabulate()
        """The QP at equal intervals of the orbit; one if the model is time-invariant."""
        self._rate: ThrustRate | None = None
        box, others = self._make_constraints()
        self.constraints = (box, *others)
        """In the order of their rows in the QP."""
        self.solver = PlanSolver(self.qps[0], box, others)

    def _check_horizons(self, common: CommonParameters) -> None:
        parameters = self._parameters
        if self._step_ns % self._tick_ns:
            raise DesignError(
                f"mpc: step is {parameters.step} s; it must be a whole number of ticks of {common.tick} s"
            )
        if self._steps > parameters.horizon:
            allowed = f"it must be at most horizon, {parameters.horizon}"
            raise DesignError(f"mpc: control_horizon is {self._steps} steps; {allowed}")
        if parameters.off_in_eclipse and parameters.thrust_rate > 0.0 and parameters.replan_interval > 0.0:
            raise DesignError(
                "mpc: off_in_eclipse and thrust_rate contradict each other in a plan that is kept for "
                f"{parameters.replan_interval:g} s; replan_interval must be 0, so that the thrust ends in time"
            )
        eclipse = longest_eclipse(common.chief)
        if parameters.off_in_eclipse and eclipse >= self._steps * parameters.step:
            raise DesignError(
                f"mpc: the horizon with thrust, {self._steps * parameters.step:.0f} s, is not longer "
                f"than the eclipse, {eclipse:.0f} s"
            )

    def _tabulate(self) -> list[CondensedQp]:
        parameters = self._parameters
        intervals = 1 if self._model.is_time_invariant else ORBIT_INTERVALS
        return condense_along_orbit(
            self._model,
            parameters.step,
            parameters.horizon,
            self._steps,
            self._plan_cost(intervals),
            self.unit / self._mass,
            intervals,
        )

    def _plan_cost(self, intervals: int) -> PlanCost:
        """The cost of a plan; with running weights its terminal cost is the LQR's cost-to-go at the intervals."""
        parameters, model, tick = self._parameters, self._model, self._tick_ns / NANOSECONDS
        state_weight, thrust_weight = parameters.state_matrix(), parameters.thrust_matrix()
        absolute = parameters.cost == "absolute"
        if parameters.weighting == "terminal":
            terminal = np.array([state_weight])
            return PlanCost(0.0 * state_weight, terminal, self.unit**2 * thrust_weight, absolute)
        ticks_per_step = parameters.step / tick
        weights = Weights.scaled(state_weight, self._effort, tick)
        grid = model.period / intervals * np.arange(intervals)
        middles = grid + 0.5 * grid[min(1, intervals - 1)]
        repeats = max(1, round(model.period / intervals / tick)) if intervals > 1 else 1
        terminal = periodic_cost_to_go([model.discretise(float(time), tick) for time in middles], repeats, weights)
        terminal *= weights.cost_unit / np.outer(weights.state_unit, weights.state_unit)
        thrust = ticks_per_step * self.unit**2 * thrust_weight
        return PlanCost(ticks_per_step * state_weight, terminal, thrust, absolute)

    def _make_constraints(self) -> tuple[ThrustBox, list[Constraint]]:
        """The thrust box and the other constraints, in descending priority for `clip`."""
        parameters, steps, unit = self._parameters, self._steps, self.unit
        limit: Vector = self.limit / unit
        others: list[Constraint] = []
        if parameters.total_thrust > 0.0:
            total = TotalThrust(parameters.total_thrust, unit, steps)
            limit = np.minimum(limit, total.distance)
            others.append(total)
        if parameters.thrust_rate > 0.0:
            # A plan that is kept changes its force within one tick; one renewed at every tick over all of them.
            change_time = self._tick_ns if parameters.replan_interval > 0.0 else self._step_ns
            self._rate = ThrustRate(parameters.thrust_rate, unit, steps, change_time, self._tick_ns)
            others.append(self._rate)
        if parameters.cost == "absolute":
            others.append(ThrustMagnitude(steps))
        if parameters.keep_out_radius > 0.0:
            others.append(
                KeepOutSpheres(
                    parameters.keep_out_radius,
                    parameters.keep_out_chief,
                    parameters.horizon,
                    steps,
                    unit,
                    min(parameters.position_error),
                    KEEP_OUT_WEIGHT * self.qps[0].scale,
                )
            )
        box = ThrustBox(limit, steps, self._step_ns, self._tick_ns, parameters.off_in_eclipse, self._rate)
        return box, others

    def figures(self) -> dict[str, Any]:
        """Horizon, size of the QP, and the gain while no constraint is active."""
        parameters = self._parameters
        return {
            "horizon [s]": parameters.step * parameters.horizon,
            "steps": parameters.horizon,
            "steps with thrust": self._steps,
            **self.solver.figures(),
            **self.fallback_law.figures(),
        }

    def linear(self, time: int) -> LinearController:
        """The LQR that the law equals while no constraint is active."""
        return self.fallback_law.linear(time)

    def activate(self, handover: Handover) -> None:
        """Plan anew; limit the thrust rate from the force commanded before."""
        self.plan = np.empty((0, 3))
        if self._rate is not None:
            self._rate.previous = handover.force

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The plan's force for this tick: from a new plan when due, else from the plan in force."""
        time, mass_ratio = estimate.time, estimate.mass / self._mass
        due = not len(self.plan) or time - self._planned_at >= self._replan_ns
        command = self._new_plan(estimate, target) if due else self._follow(time)
        force = command.force
        for constraint in reversed(self.constraints):
            force = constraint.clip(force, time, target)
        if self._rate is not None:
            self._rate.previous = np.clip(np.nan_to_num(force), -self.limit, self.limit)
        return replace(command, force=force * mass_ratio)

    def _step_at(self, time: int) -> int:
        return (time - self._planned_at) // self._step_ns

    def _follow(self, time: int) -> Command:
        """The plan's force for this tick, zero after its end."""
        step = self._step_at(time)
        return Command(self.plan[step] if step < len(self.plan) else np.zeros(3))

    def _new_plan(self, estimate: NavigationState, target: Target) -> Command:
        """The first force of a new plan; without one, the previous plan's force for this tick, or the LQR's."""
        try:
            return self._solve(estimate, target)
        except SolverError as error:
            step = self._step_at(estimate.time)
            if step < len(self.plan):
                return Command(self.plan[step], fallback=f"mpc: {error}; previous plan continues")
            force = self.fallback_law.command(replace(estimate, mass=self._mass), target).force
            return Command(force, fallback=f"mpc: {error}; no plan, LQR active")

    def _solve(self, estimate: NavigationState, target: Target) -> Command:
        """Plan from an estimate; raises SolverError."""
        if not np.abs(estimate.relative_state - target.relative_state).max() < MAX_ERROR:
            raise SolverError("error out of range")
        qp = self._qp_at(estimate)
        gradient, cost_of_free_motion = qp.tracking(estimate, target, self._step_ns)
        inputs = PlanInputs(qp, estimate, target, self.plan)
        solution = self.solver.solve(inputs, gradient, 0.5 * qp.scale * cost_of_free_motion)
        self.plan = self.unit * solution.forces
        self._planned_at = estimate.time
        return Command(self.plan[0], solution.status, solution.iterations, 2.0 * solution.cost / qp.scale)

    def _qp_at(self, estimate: NavigationState) -> CondensedQp:
        """The QP nearest to the phase of the estimated chief."""
        if len(self.qps) == 1:
            return self.qps[0]
        time = self._model.time_at(estimate.chief_state, estimate.time / NANOSECONDS)
        position = time / self._model.period * len(self.qps)
        return self.qps[round(position) % len(self.qps)]


def longest_eclipse(chief: Orbit) -> float:
    """Upper bound (s) on an eclipse: the diameter of the Earth's shadow at the chief's apogee speed."""
    apogee = chief.semi_major_axis * (1.0 + chief.eccentricity)
    speed = sqrt(MU / chief.semi_major_axis * (1.0 - chief.eccentricity) / (1.0 + chief.eccentricity))
    return 2.0 * asin(min(1.0, EARTH_RADIUS / apogee)) * apogee / speed
