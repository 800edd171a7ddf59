"""Slots of the formation in force: their target paths, and their assignment over the fleet."""

import math
from collections.abc import Mapping

import numpy as np

from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.guidance.assignment import Assignment, assign_with_phase, fuel_weights, transfer_costs
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.records import NavigationState
from formation_gnc.types import NANOSECONDS, Matrix, Vector

MAX_RANGE = 1e9
"""Distance (m) from the chief beyond which nothing counts as a formation."""

LEAST_PROPELLANT = 1e-3
"""Least propellant (kg) that a tank is taken to hold."""


def slot_count(parameters: GuidanceParameters) -> int:
    """Number of slots of the formation; of an unlimited one, as many as the fleet has satellites."""
    count = FORMATIONS[parameters.formation].slot_count(parameters.formation_parameters)
    return len(parameters.fleet) if count is None else count


def slot_path(parameters: GuidanceParameters, slot: int, phase: float) -> TargetPath:
    """Target path of a slot of the formation, at a phase of the formation (rad).

    Raises:
        ConfigurationError: the formation's parameters are not allowed.
    """
    formation = FORMATIONS[parameters.formation](parameters.formation_parameters, parameters.mean_motion, slot)
    return TARGET_MODELS[parameters.model](formation, phase, parameters)


def design_path(parameters: GuidanceParameters) -> TargetPath:
    """Target path of the slot and phase in `parameters`.

    Raises:
        ConfigurationError: no such slot, or a path beyond `MAX_RANGE`, of size zero or off any Earth orbit.
    """
    count = FORMATIONS[parameters.formation].slot_count(parameters.formation_parameters)
    if count is not None and parameters.slot >= count:
        raise ParameterError(
            f"parameter slot: {parameters.slot} is not allowed; it must be below {count}, "
            f"the slots of {parameters.formation}"
        )
    orbit = np.linspace(0.0, math.tau / parameters.mean_motion, 8)
    with np.errstate(all="ignore"):
        path = slot_path(parameters, parameters.slot, parameters.phase)
        furthest = np.abs(path.curvilinear(orbit)[:, :3]).max()
    if not furthest < MAX_RANGE:  # keeps every later target finite
        raise ConfigurationError(
            f"formation {parameters.formation}: its parameters put a target {furthest:g} m away; "
            f"it must be below {MAX_RANGE:g} m over an orbit"
        )
    if path.error()[1] == 0.0:
        raise ConfigurationError(
            f"formation {parameters.formation}: its size is zero; it must keep the deputy off the chief"
        )
    return path


def check_assignment(parameters: GuidanceParameters) -> None:
    """Check that the slots can be assigned over the fleet.

    Raises:
        ConfigurationError: no fleet, fewer slots than satellites, or not one dry mass per satellite.
    """
    fleet, slots = len(parameters.fleet), slot_count(parameters)
    if not fleet:
        raise ParameterError(f"parameter assignment: {parameters.assignment} is not allowed without a fleet; name it")
    if slots < fleet:
        raise ConfigurationError(
            f"formation {parameters.formation}: has {slots} of the {fleet} slots that the fleet needs"
        )
    if parameters.assignment == "fuel" and len(parameters.dry_masses) != fleet:
        raise ParameterError(
            f"parameter dry_masses: {list(parameters.dry_masses)} is not allowed; it must have one for each "
            f"of the fleet of {fleet}"
        )


def assign_slots(parameters: GuidanceParameters, time: float, states: Matrix, masses: Vector) -> Assignment:
    """Slots and phase with the least total delta-v for the fleet from its present states.

    Args:
        parameters: of any guidance of the fleet; they agree on the formation.
        time: now, s.
        states: (N, 6) relative states in the order of the fleet, Hill frame, m and m/s.
        masses: (N,) kg.
    """
    now, slots = np.array([time]), range(slot_count(parameters))

    def targets(phase: float) -> Matrix:
        return np.array([slot_path(parameters, slot, phase).states(now)[0] for slot in slots])

    duration = parameters.reconfiguration_time or math.tau / parameters.mean_motion
    weights = None
    if parameters.assignment == "fuel":
        weights = fuel_weights(np.maximum(masses - np.array(parameters.dry_masses), LEAST_PROPELLANT))
    return assign_with_phase(transfer_costs(states, targets, duration, parameters.mean_motion), weights)


class SlotAssigner:
    """Assigns the fleet's slots at the first tick with a state of every satellite.

    Each guidance of the fleet assigns all slots itself, from the same states and so with the same result.
    """

    def __init__(self) -> None:
        """With no assignment due."""
        self.is_due = False
        self.missing: list[str] = []
        """Satellites without a state at the latest attempt."""
        self.paths: Mapping[str, TargetPath] = {}
        """Target paths of the fleet by name; empty where slots are fixed, or not assigned yet."""

    def request(self, parameters: GuidanceParameters) -> None:
        """Drop the assignment in force; a new one is due unless slots are fixed."""
        self.is_due, self.paths = parameters.assignment != "fixed", {}

    def assign(
        self, parameters: GuidanceParameters, time: int, fleet: Mapping[str, NavigationState]
    ) -> Assignment | None:
        """The assignment at a time (ns), given the states of the fleet by name; None while one is missing."""
        self.missing = [name for name in parameters.fleet if name not in fleet]
        if self.missing:
            return None
        self.is_due = False
        states = np.array([fleet[name].relative_state for name in parameters.fleet])
        masses = np.array([fleet[name].mass for name in parameters.fleet])
        assignment = assign_slots(parameters, time / NANOSECONDS, states, masses)
        self.paths = {
            name: slot_path(parameters, slot, assignment.phase)
            for name, slot in zip(parameters.fleet, assignment.slots, strict=True)
        }
        return assignment
