"""Finite-thrust trajectories by second-order cone programmes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.common import CommonParameters
from formation_gnc.control.cone_programme import ConeError, ConeProgramme
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.models import CLOSED_FORM_MODELS, check_along_track
from formation_gnc.control.mpc_constraints import meets
from formation_gnc.control.path_constraints import TOLERANCE, ApproachCone, KeepOut, Path, PathConstraint, SpeedLimit
from formation_gnc.control.plan import Plan, held_over_tick
from formation_gnc.control.target_prediction import has_jumped
from formation_gnc.control.thrust_response import ThrustResponse
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.model import LinearModel
from formation_gnc.types import NANOSECONDS, Vector

MAX_ERROR = 1e9
"""Error (m) beyond which no plan is made."""

MAX_STEPS = 5000
"""Steps of the longest plan."""

ROUNDS = 12
"""Solutions of one plan, each with the cuts that the one before asked for."""

EXACT = 100.0
"""Price of a terminal error over the delta-v that it would take: above one, it is left only where thrust lacks."""


@dataclass(frozen=True)
class ConvexParameters:
    """Times, model and constraints of the plans."""

    model: str = parameter(
        "hill", choices=tuple(CLOSED_FORM_MODELS), in_flight=True, doc="relative-motion model of the plans"
    )
    final_time: float = parameter(
        6000.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time to reach a target, from activation of the law or a jump of the target: longer is cheaper",
    )
    holding_time: float = parameter(
        6000.0, unit="s", above=0.0, in_flight=True, doc="time of each plan after that: about a revolution"
    )
    step: float = parameter(60.0, unit="s", above=0.0, in_flight=True, doc="step of a plan; a multiple of the tick")
    replan_interval: float = parameter(
        600.0, unit="s", minimum=0.0, in_flight=True, doc="time between plans; 0 plans at every tick"
    )
    last_plan: float = parameter(
        1500.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time to go below which no plan is made anew: a later one would respond to estimation noise",
    )
    tolerance: float = parameter(
        0.1,
        unit="m",
        above=0.0,
        in_flight=True,
        doc="position error per axis that a plan leaves, at its end and in the revolution after it; above the noise "
        "of the estimate",
    )
    total_thrust: float = parameter(
        0.0,
        follows="{deputy}.thrusters.total_limit",
        unit="N",
        minimum=0.0,
        in_flight=True,
        doc="limit on the magnitude of the force, whose delta-v is then the least; 0 for none: then the sum over the "
        "axes is",
    )
    off_in_eclipse: bool = parameter(
        False,
        follows="{deputy}.thrusters.off_in_eclipse",
        in_flight=True,
        doc="no thrust in the eclipses that the target predicts, repeated beyond them, nor in a step that meets one",
    )
    no_thrust: tuple[float, ...] = parameter(
        (), unit="s", in_flight=True, doc="windows without thrust: begin and end of each, time of the run"
    )
    keep_out_radius: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="radius of a keep-out sphere about each of the other satellites; 0 for none",
    )
    keep_out_chief: bool = parameter(True, in_flight=True, doc="whether the chief has a keep-out sphere too")
    safe_time: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="passive safety: time for which coasting stays outside the spheres, whichever burn is the last",
    )
    cone_axis: tuple[float, float, float] = parameter(
        (0.0, -1.0, 0.0), in_flight=True, doc="axis of the approach cone, from the chief, Hill frame"
    )
    cone_half_angle: float = parameter(
        0.0, unit="rad", minimum=0.0, maximum=1.5, in_flight=True, doc="of the approach cone; 0 for none"
    )
    speed_limit: float = parameter(
        0.0, unit="m/s", minimum=0.0, in_flight=True, doc="largest relative speed in the approach; 0 for none"
    )
    approach_range: float = parameter(
        100.0, unit="m", above=0.0, in_flight=True, doc="distance from the chief within which cone and speed limit hold"
    )


@dataclass
class _Phase:
    """A stretch of flight with one end; times in ns of the run."""

    began_at: int
    length: int
    plan: Plan | None = None
    planned_at: int = 0
    attempted_at: int | None = None
    failure: str = ""


class Convex(Controller[ConvexParameters]):
    """The thrust history of least delta-v to the target, within the thrust limits and constraints on the path.

    An SOCP in the accelerations of equal steps: their magnitudes are priced, the position error at the quarters of the
    revolution after the end is within a tolerance, or as near as the thrust allows. A plan ends `final_time` after
    activation or a jump of the target; it is made anew with the time to go until `last_plan` before it, and after it
    plans of `holding_time` follow each other.

    Constraints on the path are not convex (keep-out spheres) or not everywhere (approach cone): they are met by cuts
    (`path_constraints`), at the ends of the steps, until the plan violates none. After Açıkmeşe and Ploen (2007, cones
    of thrust), Di Cairano, Park and Kolmanovsky (2012, rotating half-spaces) and Breger and How (2008, safety of every
    last burn).

    A plan counts only if the solver calls it solved and it is within limits and constraints when computed again.
    Otherwise the previous plan continues, and beyond its end nothing thrusts: coasting is what plans keep safe. The
    command gives the reason.

    Assumes: the model's; separation from the target and the chief much smaller than the radius.
    """

    Parameters = ConvexParameters

    def __init__(self, parameters: ConvexParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Take the model.

        Raises:
            DesignError: a step that is no multiple of the tick, too many steps, windows without an end, no axis of the
                cone, no thrust along the track, or a chief that the model is not valid about.
        """
        self._parameters, self._tick, self._limit = parameters, common.tick, vehicle.thrust_limit
        self._tick_ns, self._step_ns = common.tick_ns, round(parameters.step * NANOSECONDS)
        self._check(common.tick)
        self._model = CLOSED_FORM_MODELS[parameters.model](common)
        self._windows = np.rint(np.reshape(parameters.no_thrust, (-1, 2)) * NANOSECONDS).astype(np.int64)
        self._phase: _Phase | None = None
        self._target: Target | None = None

    def _check(self, tick: float) -> None:
        own = self._parameters
        if self._step_ns % self._tick_ns:
            raise DesignError(f"convex: step is {own.step:g} s; it must be a whole number of ticks of {tick:g} s")
        for name in ("final_time", "holding_time"):
            steps = getattr(own, name) / own.step
            if not 1.0 <= steps <= MAX_STEPS:
                raise DesignError(f"convex: {name} is {steps:g} steps; it must be 1 to {MAX_STEPS}")
        ends = np.array(own.no_thrust[1::2])
        if len(own.no_thrust) % 2 or (ends <= own.no_thrust[0::2]).any():
            raise DesignError("convex: no_thrust must be pairs of a begin and a later end")
        if own.cone_half_angle > 0.0 and not np.linalg.norm(own.cone_axis) > 0.0:
            raise DesignError("convex: cone_axis must not be zero")
        check_along_track("convex", self._limit)

    def figures(self) -> dict[str, Any]:
        """Steps of the plans."""
        own = self._parameters
        return {
            "steps to reach a target": int(own.final_time / own.step),
            "steps to hold it": int(own.holding_time / own.step),
        }

    def activate(self, handover: Handover) -> None:
        """Continue the plan of a law of this class, or begin one."""
        self._phase = None
        if isinstance(handover.law, Convex):
            self._phase, self._target = handover.law._phase, handover.law._target

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The plan's mean force over this tick."""
        own, now = self._parameters, estimate.time
        if self._phase is None or has_jumped(self._target, target):
            self._phase = _Phase(now, round(own.final_time * NANOSECONDS))
        elif now >= self._phase.began_at + self._phase.length:
            self._phase = _Phase(now, round(own.holding_time * NANOSECONDS))
        self._target, phase, solver, iterations = target, self._phase, "following", 0
        to_go = phase.began_at + phase.length - now
        if self._is_due(phase, now, to_go):
            solver, iterations = self._replan(phase, estimate, target, int(to_go // self._step_ns))
        if phase.plan is None:
            return Command(np.zeros(3), "failed", fallback=f"convex: {phase.failure}; no plan: no thrust")
        since = (now - phase.planned_at) / NANOSECONDS
        acceleration = phase.plan.mean(since, since + self._tick)
        if self._is_off(now, self._tick_ns, 1, target)[0]:
            acceleration = np.zeros(3)
        steady = held_over_tick(acceleration, estimate.chief_state, self._tick) if acceleration.any() else acceleration
        force = estimate.mass * np.where(self._limit > 0.0, steady, 0.0)
        reason = f"convex: {phase.failure}; previous plan continues" if phase.failure else ""
        return Command(force, solver, iterations, phase.plan.cost, reason)

    def _is_due(self, phase: _Phase, now: int, to_go: int) -> bool:
        """Whether to plan at this tick: without a plan at every one."""
        if to_go < self._step_ns:
            return False
        if phase.plan is None or phase.attempted_at is None:
            return True
        own = self._parameters
        return now - phase.attempted_at >= own.replan_interval * NANOSECONDS and to_go > own.last_plan * NANOSECONDS

    def _replan(self, phase: _Phase, estimate: NavigationState, target: Target, steps: int) -> tuple[str, int]:
        """Put a new plan in force if there is one; its status in words, and iterations."""
        phase.attempted_at = estimate.time
        try:
            plan, left = self._plan(estimate, target, steps)
        except ArithmeticError as error:
            phase.failure = str(error)
            return "failed", 0
        phase.plan, phase.planned_at, phase.failure = plan, estimate.time, ""
        spent = np.abs(plan.acceleration).sum() * self._parameters.step
        return f"planned: {spent:.4g} m/s to within {left:.3g} m", plan.iterations

    def _plan(self, estimate: NavigationState, target: Target, steps: int) -> tuple[Plan, float]:
        """A plan over a number of steps, and the error that it leaves, m; raises ArithmeticError."""
        own = self._parameters
        if not np.abs(estimate.relative_state - target.relative_state).max() < MAX_ERROR:
            raise ConeError("error out of range")
        seconds = estimate.time / NANOSECONDS
        model = self._model.anchored(estimate.chief_state, seconds)
        time = model.time_at(estimate.chief_state, seconds)
        start = model.averaged(estimate.chief_state, estimate.relative_state)
        coasting = math.ceil(own.safe_time / own.step)
        response = ThrustResponse.of(model, time, own.step, steps, coasting)
        limit = self._limit / estimate.mass
        path = Path(response, start, float(limit.max()))
        error = self._error(response, start, target, model.averaged(estimate.chief_state, target.relative_state))
        programme = self._programme(
            path, error, limit, self._is_off(estimate.time, self._step_ns, steps, target), model
        )
        return self._solve(programme, path, self._constraints(target, coasting), error)

    def _error(self, response: ThrustResponse, start: Vector, target: Target, goal: Vector) -> Vector:
        """(6,) error at the start whose free motion is the error at the end: the target follows its preview."""
        if not len(target.preview):
            return start - goal
        reached = min(round(response.count * response.step * NANOSECONDS) // target.preview_step, len(target.preview))
        index, rest = divmod(reached * target.preview_step, self._step_ns)
        if not reached or rest:  # none at the end of a step: the target moves freely
            return start - goal
        moved: Vector = np.linalg.solve(response.free[index], target.preview[reached - 1])
        return start - moved

    def _is_off(self, time: int, step: int, steps: int, target: Target) -> NDArray[np.bool_]:
        """(steps,) whether there is no thrust in each step (ns) from a time."""
        windows = self._windows
        if self._parameters.off_in_eclipse:
            windows = np.vstack([windows, self._eclipses(time + step * steps, target)])
        return meets(time, step, steps, windows)

    def _eclipses(self, end: int, target: Target) -> NDArray[np.int64]:
        """(N, 2) eclipses until a time: those predicted, and the last of them in every revolution after."""
        known, period = target.eclipses, round(self._model.period * NANOSECONDS)
        if not len(known):
            return known
        more = max(0, (end - int(known[-1, 0])) // period + 1)
        return np.vstack([known, known[-1] + period * np.arange(1, more + 1)[:, None]])

    def _programme(
        self, path: Path, error: Vector, limit: Vector, off: NDArray[np.bool_], model: LinearModel
    ) -> ConeProgramme:
        """Least delta-v to within the tolerance, forces over the largest limit and lengths over the error."""
        own, response = self._parameters, path.response
        quarters, last = response.after[:, :3].reshape(-1, 6), response.free[response.count]
        length = max(float(np.abs(quarters @ last @ error).max()), own.tolerance)
        rate, duration = math.tau / model.period, response.count * response.step
        unit = np.repeat([length, length * rate], 3)
        forced = path.unit * np.einsum("ij,kjl->ikl", last, response.pushed).reshape(6, -1)
        soft, margin = quarters * (unit / length), np.full(2 * len(quarters), own.tolerance / length)
        return ConeProgramme(
            np.where(off[:, None], 0.0, limit / path.unit),
            own.total_thrust / float(self._limit.max()),
            np.full(response.count, path.unit * response.step / (length * rate)),
            EXACT * max(1.0, 4.0 / (rate * duration)) ** 2,
            (forced / unit[:, None], last @ error / unit),
            (np.vstack([soft, -soft]), margin),
        )

    def _constraints(self, target: Target, coasting: int) -> list[PathConstraint]:
        own, found = self._parameters, list[PathConstraint]()
        centres = np.vstack([np.zeros((int(own.keep_out_chief), 6)), target.neighbours])
        if own.keep_out_radius > 0.0 and len(centres):
            found.append(KeepOut(own.keep_out_radius, centres, coasting))
        if own.cone_half_angle > 0.0:
            axis = np.array(own.cone_axis) / np.linalg.norm(own.cone_axis)
            found.append(ApproachCone(axis, own.cone_half_angle, own.approach_range))
        if own.speed_limit > 0.0:
            found.append(SpeedLimit(own.speed_limit, own.approach_range))
        return found

    def _solve(
        self, programme: ConeProgramme, path: Path, constraints: list[PathConstraint], error: Vector
    ) -> tuple[Plan, float]:
        """Solve, and again with the cuts that the solution asks for, until it asks for none."""
        response, iterations = path.response, 0
        for _ in range(ROUNDS):
            forces, _, more = programme.solve()
            iterations += more
            accelerations = path.unit * programme.within_limits(forces)
            before = len(programme.above) + len(programme.cones)
            worst = max([each.cut(path, accelerations, programme) for each in constraints], default=0.0)
            if len(programme.above) + len(programme.cones) == before:
                break
        if worst > TOLERANCE:
            raise ConeError(f"constraints on the path violated by {worst:.2%}")
        end = response.free[response.count] @ response.origins(error, accelerations)[-1]
        left = float(np.abs(response.after[:, :3] @ end).max())
        return Plan(accelerations, response.count * response.step, iterations), left
