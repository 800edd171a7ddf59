"""Guidance: the target of a deputy, now and over the controller's horizon."""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.flight.mode import ModeInForce
from formation_gnc.flight.module import FlightModule
from formation_gnc.guidance.eclipse_forecast import EclipseForecast
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.guidance.reconfiguration import (
    GuidanceConfiguration,
    GuidancePlan,
    NewTarget,
    ReconfigurationLock,
    is_same_target,
    leaves_target,
    transfer_to,
)
from formation_gnc.guidance.separation import SeparationMonitor, describe, least_from_track, predict
from formation_gnc.guidance.slots import MAX_RANGE, SlotAssigner, check_assignment, design_path
from formation_gnc.guidance.targets import TargetPath
from formation_gnc.mode_records import Mode, ModeState
from formation_gnc.parameters import to_json
from formation_gnc.records import NO_NEIGHBOURS, EventKind, NavigationState, ParameterChange, Separation, Target
from formation_gnc.types import NANOSECONDS, Vector

MODEL_ERROR = 0.05
"""Largest error of the target's model in a revolution that is not reported, as a share of the formation's size."""

OCCUPIED = 0.05
"""Least distance, and rate times a radian, within which a neighbour occupies a slot, as a share of the
formation's size: above control errors, below the distance between slots."""


FIRM = frozenset({Mode.AVOID, Mode.SAFE})
"""Modes in which the target stays."""


class Guidance(FlightModule[GuidanceParameters, TargetPath]):
    """Target of one deputy in its formation, and the predicted separation from its neighbours.

    Events report a model that does not fit the formation, and for every change of target the distance and the
    shortest time that the thrusters allow.
    """

    def __init__(self, name: str, parameters: GuidanceParameters) -> None:
        """Design the target path; `name` is the node's full name, its namespace the deputy's.

        Raises:
            ConfigurationError: a formation that cannot be flown, or a fleet without the deputy or with a name
                twice.
        """
        self._deputy = name.rpartition("/")[0].strip("/")
        if parameters.fleet and self._deputy not in parameters.fleet:
            raise ParameterError(
                f"parameter fleet: {list(parameters.fleet)} is not allowed; {self._deputy} must be one of it"
            )
        if len(set(parameters.fleet)) != len(parameters.fleet):
            raise ParameterError(f"parameter fleet: {list(parameters.fleet)} is not allowed; no name may come twice")
        self.neighbours = tuple(each for each in parameters.fleet if each != self._deputy)
        """The other satellites of the fleet."""
        super().__init__(name, parameters)

    def design(self, parameters: GuidanceParameters) -> TargetPath:
        """Target path of the deputy's slot in the formation."""
        if parameters.assignment != "fixed":
            check_assignment(parameters)
        return design_path(parameters)

    def reset(self) -> None:
        """Start a run: nothing forecast, predicted, locked or reported yet."""
        self._lock = ReconfigurationLock()
        self._slots = SlotAssigner()
        self._slots.request(self.parameters)
        self._eclipses = EclipseForecast()
        self._separations = SeparationMonitor()
        self._new_target: NewTarget | None = NewTarget()
        self._neighbour_states: Mapping[str, NavigationState] = {}
        self._mode = ModeInForce()

    def on_tick(
        self, estimate: NavigationState, mode: ModeState | None = None, *neighbours: NavigationState | None
    ) -> tuple[Target, Separation | None]:
        """The target at the estimate's stamp, and the predicted separation when one is due.

        Args:
            estimate: of this deputy.
            mode: of the tick before; None for the one that stands.
            neighbours: estimates of `self.neighbours` at the same stamp; None for one that is missing.
        """
        self._mode.take(mode)
        self.begin_tick(estimate.time)
        if neighbours:
            self._neighbour_states = {
                name: each
                for name, each in zip(self.neighbours, neighbours, strict=True)
                if each is not None and _is_plausible(each)
            }
        if self._slots.is_due:
            self._assign_slot(estimate)
        parameters = self.parameters
        preview_step, ahead = _preview(parameters.preview_step, parameters.preview_steps)
        path = self.configuration.design
        states = path.states_ahead(estimate.chief_state, estimate.time / NANOSECONDS, ahead)
        if self._new_target is not None:
            self._report_target(self._new_target, estimate, states[0])
            self._new_target = None
        target = Target(
            estimate.time,
            parameters.formation,
            states[0],
            preview_step,
            states[1:],
            self._eclipses.intervals(estimate.time, estimate.chief_state, parameters),
            np.array([each.relative_state for each in self._neighbour_states.values()])
            if self._neighbour_states
            else NO_NEIGHBOURS,
            self._lock.is_closed(estimate.time),
        )
        separation = self._predict_separation(estimate, target) if neighbours else None
        if separation is not None:
            target.separation = [separation]
        return target, separation

    def check_staged(self, staged: GuidanceConfiguration) -> None:
        """Reject a new target while a reconfiguration is under way or the mode evades, for one deputy alone where
        slots are assigned over the fleet, and in an occupied slot."""
        self.check_due(self.time, staged)
        if self.parameters.assignment != "fixed" and not leaves_target(staged.changes):
            raise ConfigurationError(
                f"assignment is {self.parameters.assignment}: the whole fleet changes at one tick, and so by "
                "schedule only; the target stays"
            )
        self._check_unoccupied(staged)

    def check_due(self, time: int, due: GuidanceConfiguration) -> None:
        """Reject a new target while a reconfiguration is under way, or the mode evades."""
        self._lock.check(time, due.changes)
        if self._mode.name in FIRM and not leaves_target(due.changes):
            raise ConfigurationError(f"mode is {self._mode.name}: the target stays; command another mode first")

    def check_plan(self, start: GuidanceConfiguration, plan: GuidancePlan) -> None:
        """Reject a scheduled change of target within the time of the previous one."""
        self._lock.check_plan(start, plan)

    def activate(self, old: GuidanceConfiguration, new: GuidanceConfiguration) -> None:
        """Begin a reconfiguration if the target changes."""
        if is_same_target(old, new, self.time):
            return
        self._lock.begin(self.time, new.parameters.reconfiguration_time)
        self._slots.request(new.parameters)
        self._new_target = NewTarget(old.parameters.formation)

    def _check_unoccupied(self, staged: GuidanceConfiguration) -> None:
        """Reject a new target that a neighbour occupies."""
        if is_same_target(self.configuration, staged, self.time):
            return
        target = staged.design.states(np.array([self.time / NANOSECONDS]))[0]
        room = max(OCCUPIED * staged.design.error()[1], staged.parameters.separation_warning)
        reach = room * np.repeat([1.0, staged.parameters.mean_motion], 3)
        for name, each in self._neighbour_states.items():
            if (np.abs(each.relative_state - target) < reach).all():
                raise ConfigurationError(
                    f"slot {staged.parameters.slot} of {staged.parameters.formation}: {name} is there, "
                    f"within {room:g} m; each must have its own, and the target stays"
                )

    def _assign_slot(self, estimate: NavigationState) -> None:
        """Take this deputy's slot of an assignment over the fleet, if every satellite has a state."""
        fleet = dict(self._neighbour_states)
        if _is_plausible(estimate):
            fleet[self._deputy] = estimate
        known_missing = self._slots.missing
        assignment = self._slots.assign(self.parameters, estimate.time, fleet)
        if assignment is None:
            if self._slots.missing != known_missing:
                missing = ", ".join(self._slots.missing)
                self.log(estimate.time, EventKind.WARNING, "no state: slots stay until there is one", missing)
            return
        index = self.parameters.fleet.index(self._deputy)
        slot, phase = assignment.slots[index], assignment.phase
        previous = self.parameters
        self.configuration = self.derive(previous, {"slot": slot, "phase": phase})
        self.log(
            estimate.time,
            EventKind.ASSIGNMENT,
            f"slot {slot}, phase {phase:.4f} rad, "
            f"{assignment.delta_v[index]:.3g} m/s of the fleet's {sum(assignment.delta_v):.3g} m/s",
            self.parameters.formation,
            [
                ParameterChange("slot", to_json(previous.slot), to_json(slot)),
                ParameterChange("phase", to_json(previous.phase), to_json(phase)),
            ],
        )

    def _report_target(self, new: NewTarget, estimate: NavigationState, target: Vector) -> None:
        """Report a model that does not fit, and the transfer to a target that changed in flight."""
        parameters = self.parameters
        error, size = self.configuration.design.error()
        if error > MODEL_ERROR * size:
            self.log(
                estimate.time,
                EventKind.WARNING,
                f"in model {parameters.model}: off by {error:.3g} m in the first revolution, "
                f"at {size:.3g} m from the chief",
                parameters.formation,
            )
        if parameters.safe_distance > 0.0:
            self._report_safety(estimate, target)
        transfer = transfer_to(target, estimate, parameters) if new.previous_formation else None
        if transfer is None:
            return
        kind, detail = EventKind.RECONFIGURATION, f"from {new.previous_formation} to slot {parameters.slot}: {transfer}"
        if not transfer.is_feasible:
            kind = EventKind.INFEASIBLE
            detail += f", above the {parameters.reconfiguration_time:g} s allowed"
        self.log(estimate.time, kind, detail, parameters.formation)

    def _report_safety(self, estimate: NavigationState, target: Vector) -> None:
        """Warn of a target that comes too near the chief's track, where an along-track error would be a collision."""
        parameters = self.parameters
        nearest = least_from_track(target, estimate.chief_state, parameters.mean_motion)
        if nearest < parameters.safe_distance:
            self.log(
                estimate.time,
                EventKind.WARNING,
                f"not passively safe: {nearest:.3g} m from the chief's track across the flight direction, below "
                f"safe_distance, {parameters.safe_distance:g} m",
                parameters.formation,
            )

    def _predict_separation(self, estimate: NavigationState, target: Target) -> Separation | None:
        """The predicted separation when one is due; logs an event when a warning begins or ends."""
        parameters = self.parameters
        if not (
            self._neighbour_states
            and self._separations.is_due(estimate.time, parameters.separation_interval)
            and _is_plausible(estimate)
        ):
            return None
        chief, time = estimate.chief_state, estimate.time / NANOSECONDS
        separation = predict(
            self.configuration.design.anchored(chief, time),
            target,
            estimate.relative_state,
            list(self._neighbour_states),
            {name: path.anchored(chief, time) for name, path in self._slots.paths.items()},
            parameters.separation_horizon,
            parameters.mean_motion,
        )
        warned = self._separations.is_warning
        self._separations.note(separation, parameters.separation_warning)
        if self._separations.is_warning and not warned:
            self.log(estimate.time, EventKind.SEPARATION, describe(separation), separation.nearest)
        elif warned and not self._separations.is_warning:
            self.log(estimate.time, EventKind.SEPARATION, "over")
        return separation


@lru_cache(maxsize=16)
def _preview(step: float, steps: int) -> tuple[int, Vector]:
    """Step (ns) of a preview, and times (s) of a target and its preview from the tick on, (1 + steps,)."""
    return round(step * NANOSECONDS), step * np.arange(steps + 1.0)


def _is_plausible(estimate: NavigationState) -> bool:
    """Whether state and mass are finite, and possible for a satellite in formation."""
    for each in estimate.relative_state.tolist():  # numbers: a sixth of the time of an array
        if not -MAX_RANGE < each < MAX_RANGE:
            return False
    return 0.0 < estimate.mass < math.inf
