"""Model predictive control."""

from dataclasses import dataclass, replace
from math import asin, sqrt
from typing import Any

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.condensed_qp import CondensedQp, facet_normals, facet_reach
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.linear import LinearController
from formation_gnc.control.lqr import STRETCHES, LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.riccati import Weights, periodic_cost_to_go
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import DesignError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import NANOSECONDS, Vector

ACCURACY = 1e-4
"""Residual at which OSQP stops, with force in units of the thrust limit."""

MOST_ITERATIONS = 2000
"""Iterations after which the answer does not count: some ten milliseconds at 30 steps."""

SETTINGS = {
    "verbose": False,
    "eps_abs": ACCURACY,
    "eps_rel": ACCURACY,
    "max_iter": MOST_ITERATIONS,
    "check_termination": 10,
    "adaptive_rho": 1,  # by iterations, not by a clock
    "adaptive_rho_interval": 50,
    "polishing": False,
}
"""Of OSQP."""

FARTHEST = 1e12
"""Error, m, that nobody flies, and beyond which products overflow."""

KEEP_OUT_WEIGHT = 1e4
"""Cost of a keep-out sphere entered by one position error, over the weight of that error."""


@dataclass(frozen=True)
class MpcParameters(QuadraticWeights):
    """Weights, plan and limits."""

    model: str = parameter(
        "hill", choices=tuple(DESIGN_MODELS), in_flight=True, doc="relative motion that the plan is made on"
    )
    step: float = parameter(60.0, unit="s", above=0.0, in_flight=True, doc="step of the plan; whole ticks")
    horizon: int = parameter(30, minimum=1, maximum=500, in_flight=True, doc="steps that the plan looks ahead")
    control_horizon: int = parameter(
        0, minimum=0, maximum=500, in_flight=True, doc="steps with thrust, none after them; 0 for all"
    )
    replan_interval: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time for which one plan is flown; 0 plans at every tick",
    )
    weighting: str = parameter(
        "running",
        choices=("running", "terminal"),
        in_flight=True,
        doc="running: the error at all times, beyond the horizon as LQR would pay, and thrust by the tick; "
        "terminal: only the error at the horizon's end, and thrust by the step (Kremmydas)",
    )
    cost: str = parameter(
        "quadratic",
        choices=("quadratic", "absolute"),
        in_flight=True,
        doc="cost of thrust; absolute is delta-v",
    )
    total_thrust: float = parameter(
        0.0,
        unit="N",
        minimum=0.0,
        in_flight=True,
        doc="largest magnitude of the force, by a polyhedron inside; 0 for none",
    )
    thrust_rate: float = parameter(
        0.0, unit="N/s", minimum=0.0, in_flight=True, doc="fastest change of the force, per axis; 0 for any"
    )
    keep_out_radius: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="radius of a soft keep-out sphere about each of the other satellites; 0 for none",
    )
    keep_out_chief: bool = parameter(
        True, in_flight=True, doc="whether the chief is a satellite too, with such a sphere"
    )
    off_in_eclipse: bool = parameter(
        False,
        in_flight=True,
        doc="no thrust in the eclipses that the target foresees, nor in a step of the plan that meets one",
    )


class ModelPredictiveController(Controller):
    """Plans thrust over a horizon by a quadratic programme, within the limits, and flies the plan's first
    steps.

    Running weights: the discrete LQR's cost per tick over the horizon, then its cost-to-go, so that without
    active limits the law is that LQR. Terminal weights (Kremmydas 4.3): only the error at the horizon's end
    counts, against a target carried there; the target's preview is used as far as it reaches on the plan's
    steps, and free motion from there. With `replan_interval`, one plan is flown for that long (multistep);
    without, a plan is made at every tick from the one before (receding).

    The states are eliminated: the programme has the forces alone, which was measured to be twice as fast as
    keeping the states with their sparse equations. A model that varies along the orbit has its programme
    tabulated every two degrees.

    OSQP's answer counts with the status solved, finite and inside the limits. Otherwise the last plan's step
    for this time flies, and without one LQR on the same weights; the command says so. Its iterations, not a
    clock, end the solver and adapt its step, so that equal inputs give equal commands.

    Assumes: separation much smaller than the chief's radius; what the model assumes; a mass near that of the
    design.
    """

    Parameters = MpcParameters

    def __init__(self, parameters: MpcParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Tabulate the programme.

        Raises:
            DesignError: a step that is not whole ticks, horizons that do not fit one another or the eclipse,
            or no LQR.
        """
        self._parameters = parameters
        self._tick_ns, self._step_ns = common.tick_ns, round(parameters.step * NANOSECONDS)
        if self._step_ns % self._tick_ns:
            raise DesignError(
                f"mpc: step is {parameters.step} s; it must be a whole number of ticks of {common.tick} s"
            )
        self._steps = parameters.control_horizon or parameters.horizon
        if self._steps > parameters.horizon:
            allowed = f"it must be at most horizon, {parameters.horizon}"
            raise DesignError(f"mpc: control_horizon is {self._steps} steps; {allowed}")
        self._model = DESIGN_MODELS[parameters.model](common)
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        if parameters.total_thrust > 0.0:
            self._limit = np.minimum(self._limit, parameters.total_thrust)
        self._unit = float(self._limit.max())
        eclipse = longest_eclipse(common.chief)
        if parameters.off_in_eclipse and eclipse >= self._steps * parameters.step:
            raise DesignError(
                f"mpc: the horizon with thrust, {self._steps * parameters.step:.0f} s, is not longer "
                f"than the eclipse, {eclipse:.0f} s"
            )
        gain = "discrete" if self._model.is_time_invariant else "periodic"
        try:
            self.reserve = LinearQuadraticRegulator(
                LqrParameters(model=parameters.model, gain=gain, **parameters.weights()), common, vehicle
            )
        except DesignError as error:
            raise DesignError(f"mpc, in reserve {error}") from error
        self._force = np.zeros(3)
        self._plan = np.empty((0, 3))
        self._planned_at = 0
        self._answer = ""
        self._constant_bounds: tuple[Vector, Vector] | None = None
        self._programmes = self._tabulate()
        self._place = 0
        self._setup()

    def _tabulate(self) -> list[CondensedQp]:
        """The programme at each of the places along the orbit."""
        parameters, tick = self._parameters, self._tick_ns / NANOSECONDS
        stretches = 1 if self._model.is_time_invariant else STRETCHES
        state_weight, thrust_weight = parameters.state_matrix(), parameters.thrust_matrix()
        grid = self._model.period / stretches * np.arange(stretches)
        table = [self._model.discretise(float(time), parameters.step) for time in grid]
        phi, gamma = (np.array(each) for each in zip(*table, strict=True))
        if parameters.weighting == "terminal":
            ends, share, running = np.array([state_weight]), 1.0, 0.0 * state_weight
        else:
            share = parameters.step / tick
            running = share * state_weight
            weights = Weights.scaled(state_weight, self._mass**2 * thrust_weight, tick)
            ticks = [self._model.discretise(float(time), tick) for time in grid + 0.5 * grid[min(1, stretches - 1)]]
            repeats = max(1, round(self._model.period / stretches / tick)) if stretches > 1 else 1
            ends = periodic_cost_to_go(ticks, repeats, weights)
            ends *= weights.cost_unit / np.outer(weights.state_unit, weights.state_unit)
        programmes = []
        for start in range(stretches):
            places = start + parameters.step * np.arange(parameters.horizon + 1) * stretches / self._model.period
            below = np.floor(places).astype(int)
            part = (places - below)[:, None, None]
            along = [
                (1.0 - part) * each[below % stretches] + part * each[(below + 1) % stretches] for each in (phi, gamma)
            ]
            programmes.append(
                CondensedQp.condensed(
                    along[0][:-1],
                    along[1][:-1] * (self._unit / self._mass),
                    self._steps,
                    running,
                    ends[below[-1] % len(ends)],
                    share * self._unit**2 * thrust_weight,
                    parameters.cost,
                )
            )
        return programmes

    def _setup(self) -> None:
        """Give OSQP the first programme, with the rows of all constraints."""
        parameters, steps = self._parameters, self._steps
        count = 3 * steps
        eye = sparse.eye_array(count)
        extra = count * (parameters.cost == "absolute") + parameters.horizon * (parameters.keep_out_radius > 0.0)
        blocks = [[eye, sparse.csc_array((count, extra))]]
        if parameters.total_thrust > 0.0:
            facets = sparse.kron(sparse.eye_array(steps), sparse.csc_array(facet_normals()[3:]))
            blocks.append([facets, sparse.csc_array((facets.shape[0], extra))])
        if parameters.thrust_rate > 0.0:
            blocks.append([eye - sparse.eye_array(count, k=-3), sparse.csc_array((count, extra))])
        if parameters.cost == "absolute":
            rest = sparse.csc_array((count, extra - count))
            blocks.append([eye, sparse.hstack([-eye, rest])])
            blocks.append([eye, sparse.hstack([eye, rest])])
        if parameters.keep_out_radius > 0.0:
            rows = np.repeat(np.tri(parameters.horizon, steps), 3, axis=1)
            beyond = sparse.csc_array((parameters.horizon, extra - parameters.horizon))
            blocks.append([sparse.csc_array(2.0 * rows), sparse.hstack([beyond, sparse.eye_array(parameters.horizon)])])
        self._rows = sparse.csc_array(sparse.block_array(blocks))
        self._rows.sort_indices()
        self._keep_out_entries = np.flatnonzero(self._rows.data == 2.0)
        column = np.repeat(np.arange(self._rows.shape[1]), np.diff(self._rows.indptr))[self._keep_out_entries]
        row = self._rows.indices[self._keep_out_entries] - (self._rows.shape[0] - parameters.horizon)
        self._keep_out_index = row, column
        self._extra = extra
        slack = np.zeros(extra)
        if parameters.keep_out_radius > 0.0:
            slack[-parameters.horizon :] = KEEP_OUT_WEIGHT * self._programmes[0].scale
        pattern = sparse.block_diag(
            [sparse.csc_array(np.triu(np.ones((count, count)))), sparse.diags_array(np.ones(extra))],
            format="csc",
        )
        self._hessian_rest = slack
        pattern.data = self._hessian(self._programmes[0])
        size = self._rows.shape[0]
        self.matrices = sparse.csc_matrix(pattern), sparse.csc_matrix(self._rows)
        self._solver = osqp.OSQP()
        self._solver.setup(
            self.matrices[0],
            np.zeros(count + extra),
            self.matrices[1],
            np.full(size, -1.0),
            np.full(size, 1.0),
            **SETTINGS,
        )

    def figures(self) -> dict[str, Any]:
        """The horizon, the size of the quadratic programme, and the gain that it becomes without limits."""
        rows, variables = self._rows.shape
        parameters = self._parameters
        return {
            "horizon [s]": parameters.step * parameters.horizon,
            "steps": parameters.horizon,
            "steps with thrust": self._steps,
            "variables": variables,
            "constraints": rows,
            "entries of Hessian and constraints": self._rows.nnz + len(self._hessian(self._programmes[0])),
            **self.reserve.figures(),
        }

    def linear(self, time: int) -> LinearController:
        """The LQR that it becomes without active limits."""
        return self.reserve.linear(time)

    def _hessian(self, programme: CondensedQp) -> Vector:
        return np.concatenate([programme.hessian, self._hessian_rest])

    def activate(self, handover: Handover) -> None:
        """Start from the force that flew before."""
        self._force = handover.force

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The plan's force for this tick: from a new plan when one is due, else from the plan in force."""
        time, share = estimate.time, estimate.mass / self._mass
        due = not len(self._plan) or time - self._planned_at >= max(
            round(self._parameters.replan_interval * NANOSECONDS), 1
        )
        command = self._solve(estimate, target) if due else self._follow(time, "")
        if command is None:
            command = self._follow(time, f"mpc: {self._answer}; the last plan flies")
        if command is None:
            reserve = self.reserve.command(replace(estimate, mass=self._mass), target).force
            command = Command(reserve, fallback=f"mpc: {self._answer}; no plan, LQR flies")
        force = self._held(command.force, time, target)
        if self._parameters.thrust_rate > 0.0:  # from where the next force may differ so much only
            self._force = np.clip(np.nan_to_num(force), -self._limit, self._limit)
        return replace(command, force=force * share)

    def _held(self, force: Vector, time: int, target: Target) -> Vector:
        """A force within what holds besides the limit per axis: the solver keeps to it but for its accuracy,
        and neither an older plan nor LQR knows what is so now."""
        parameters = self._parameters
        if parameters.off_in_eclipse and self._dark(time, self._tick_ns, 1, target).any():
            return np.zeros(3)
        if parameters.thrust_rate > 0.0:
            change = parameters.thrust_rate * self._tick_ns / NANOSECONDS
            force = np.clip(force, self._force - change, self._force + change)
        if parameters.total_thrust > 0.0:
            force = force * min(1.0, parameters.total_thrust / max(float(np.linalg.norm(force)), 1e-300))
        return force

    @staticmethod
    def _dark(time: int, step: int, steps: int, target: Target) -> NDArray[np.bool_]:
        """(steps,) whether any part of each step (ns) from a time (ns) is in a foreseen eclipse."""
        begin = time + step * np.arange(steps)[:, None]
        end = begin + step
        dark: NDArray[np.bool_] = np.any((begin < target.eclipses[:, 1]) & (end > target.eclipses[:, 0]), axis=1)
        return dark

    def _follow(self, time: int, reason: str) -> Command | None:
        """The step of the plan in force for this time: none when there is no plan or it has ended early."""
        index = (time - self._planned_at) // self._step_ns
        if index < len(self._plan):
            return Command(self._plan[index], fallback=reason)
        return Command(np.zeros(3)) if len(self._plan) and not reason else None

    def _solve(self, estimate: NavigationState, target: Target) -> Command | None:
        """The first force of a new plan, or None with the reason in `_answer`."""
        parameters, count = self._parameters, 3 * self._steps
        if not np.abs(estimate.relative_state - target.relative_state).max() < FARTHEST:
            self._answer = "the error is out of any range"
            return None
        programme = self._programme_at(estimate.time)
        gradient = np.zeros(count + self._extra)
        gradient[:count], cost_of_free = self._error_of_free_motion(programme, estimate, target)
        if parameters.cost == "absolute":
            gradient[count : 2 * count] = programme.price
        lower, upper = self._bounds(estimate.time, target)
        rows = {}
        if parameters.keep_out_radius > 0.0:
            rows = {"Ax": self._keep_out(programme, estimate, target, lower)}
        self._solver.update(q=gradient, l=lower, u=upper, **rows)
        result = self._solver.solve(raise_error=False)
        self._answer = result.info.status
        solution = result.x
        if result.info.status_val != osqp.SolverStatus.OSQP_SOLVED or not np.isfinite(solution).all():
            self._solver.warm_start(x=np.zeros(count + self._extra), y=np.zeros(len(lower)))
            return None
        box_lower, box_upper = lower[:count], upper[:count]
        force = np.clip(solution[:count], box_lower, box_upper)
        if np.abs(force - solution[:count]).max() > 100.0 * ACCURACY:
            self._answer = f"{result.info.status}, but outside the limits"
            return None
        self._plan = (self._unit * force).reshape(-1, 3)
        self._planned_at = estimate.time
        cost = 2.0 * result.info.obj_val / programme.scale + cost_of_free
        return Command(self._plan[0], result.info.status, int(result.info.iter), float(cost))

    def _programme_at(self, time: int) -> CondensedQp:
        place = 0
        if len(self._programmes) > 1:
            places = time / NANOSECONDS / self._model.period * len(self._programmes)
            place = round(places) % len(self._programmes)
        if place != self._place:
            self._place = place
            self._solver.update(Px=self._hessian(self._programmes[place]))
        return self._programmes[place]

    def _error_of_free_motion(
        self, programme: CondensedQp, estimate: NavigationState, target: Target
    ) -> tuple[Vector, float]:
        """Scaled gradient at no thrust, and its cost."""
        horizon = self._parameters.horizon
        now = estimate.relative_state - target.relative_state
        if not len(target.preview) or target.preview_step != self._step_ns:
            # The target moves freely: so does the error, from the error of now.
            return programme.gradient_of_state @ now, float(now @ programme.cost_of_state @ now)
        goal = np.empty((horizon, 6))
        ahead = min(len(target.preview), horizon)
        goal[:ahead] = target.preview[:ahead]
        for step in range(ahead, horizon):
            goal[step] = programme.steps[step] @ goal[step - 1]
        error = (programme.free @ estimate.relative_state).reshape(horizon, 6) - goal
        weighted = (programme.weight @ error[:, :, None])[:, :, 0]
        return programme.gradient @ error.ravel(), float(np.sum(error * weighted))

    def _bounds(self, time: int, target: Target) -> tuple[Vector, Vector]:
        """Bounds of all rows; those that no time and no force change are made once."""
        parameters, steps = self._parameters, self._steps
        constant = not (parameters.off_in_eclipse or parameters.thrust_rate or parameters.keep_out_radius)
        if constant and self._constant_bounds is not None:
            return self._constant_bounds
        box = np.tile(self._limit / self._unit, steps)
        if parameters.off_in_eclipse:
            box[np.repeat(self._dark(time, self._step_ns, steps, target), 3)] = 0.0
        facet = np.full(10 * steps, parameters.total_thrust / self._unit / facet_reach())
        if parameters.total_thrust > 0.0:
            box = np.minimum(box, facet[0])
        lower, upper = [-box], [box]
        if parameters.total_thrust > 0.0:
            lower.append(-facet)
            upper.append(facet)
        if parameters.thrust_rate > 0.0:
            # A plan that is flown as it is changes at one tick; one that is made anew at every tick changes
            # at all of them.
            span = self._tick_ns if parameters.replan_interval > 0.0 else self._step_ns
            change = np.full(3 * steps, parameters.thrust_rate * span / NANOSECONDS / self._unit)
            change[:3] = parameters.thrust_rate * self._tick_ns / NANOSECONDS / self._unit
            middle = np.zeros(3 * steps)
            middle[:3] = self._force / self._unit
            lower.append(middle - change)
            upper.append(middle + change)
        if parameters.cost == "absolute":
            lower += [np.full(3 * steps, -np.inf), np.zeros(3 * steps)]
            upper += [np.zeros(3 * steps), np.full(3 * steps, np.inf)]
        if parameters.keep_out_radius > 0.0:
            lower.append(np.zeros(parameters.horizon))
            upper.append(np.full(parameters.horizon, np.inf))
        bounds = np.concatenate(lower), np.concatenate(upper)
        self._constant_bounds = bounds if constant else None
        return bounds

    def _keep_out(self, programme: CondensedQp, estimate: NavigationState, target: Target, lower: Vector) -> Vector:
        """Keep to the outside of a plane per step: that which touches the sphere of the satellite that is
        nearest then, where the last plan comes closest to it. The others fly freely.

        Sets the last rows of `lower`, and returns the elements of all rows.
        """
        parameters, horizon = self._parameters, self._parameters.horizon
        data: Vector = self._rows.data.copy()
        others = np.vstack([target.neighbours, np.zeros((int(parameters.keep_out_chief), 6))])
        if not len(others):
            data[self._keep_out_entries], lower[-horizon:] = 0.0, -np.inf
            return data
        unit = np.array(parameters.position_error).min()
        # How the satellite would come past each of the others without thrust, and how with the last plan.
        free = (programme.free @ (estimate.relative_state - others).T).reshape(horizon, 6, -1)[:, :3]
        forced = programme.forced.reshape(horizon, 6, -1)[:, :3]
        planned = np.zeros((self._steps, 3))
        planned[: len(self._plan)] = self._plan / self._unit
        past = free + (forced @ planned.ravel())[:, :, None]
        distance = np.linalg.norm(past, axis=1)
        nearest = np.arange(horizon), slice(None), distance.argmin(axis=1)
        distance = distance.min(axis=1)[:, None]
        normal = np.where(distance > 1e-9, past[nearest] / np.maximum(distance, 1e-9), [0.0, 1.0, 0.0])
        data[self._keep_out_entries] = (np.einsum("ki,kij->kj", normal, forced) / unit)[self._keep_out_index]
        lower[-horizon:] = (parameters.keep_out_radius - np.einsum("ki,ki->k", normal, free[nearest])) / unit
        return data


def longest_eclipse(chief: Orbit) -> float:
    """Time (s) across the Earth's shadow where the chief is slowest: no eclipse is longer."""
    apogee = chief.semi_major_axis * (1.0 + chief.eccentricity)
    speed = sqrt(MU / chief.semi_major_axis * (1.0 - chief.eccentricity) / (1.0 + chief.eccentricity))
    return 2.0 * asin(min(1.0, EARTH_RADIUS / apogee)) * apogee / speed
