"""What the guidances of a fleet decide alike, each from the same estimates of one stamp."""

import math
from typing import Any

import numpy as np

from formation_gnc.guidance.assignment import Assignment, assign_with_phase, fuel_weights, transfer_costs
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.types import Matrix, Vector

LEAST_TANK = 1e-3
"""Propellant (kg) that the emptiest tank counts as."""


def places_for(parameters: Any) -> int:
    """Places of the formation that a guidance has in its parameters; as many as the fleet has satellites
    where they do not end."""
    places = FORMATIONS[parameters.formation].places(getattr(parameters, parameters.formation))
    return len(parameters.fleet) if places is None else places


def path_to(parameters: Any, slot: int, phase: float) -> TargetPath:
    """The path of a place of the formation that a guidance has in its parameters, at a phase (rad)."""
    kind, own = FORMATIONS[parameters.formation], getattr(parameters, parameters.formation)
    return TARGET_MODELS[parameters.model](kind(own, parameters.mean_motion, slot), phase, parameters)


def assign_slots(parameters: Any, time: float, states: Matrix, masses: Vector) -> Assignment:
    """Places of a fleet in its formation, and the formation's phase, for the least total delta-v from now.

    Args:
        parameters: of any of the guidances, which all say the same of the formation.
        time: now, s.
        states: (N, 6) relative states of the fleet, in its order, Hill frame, m and m/s.
        masses: (N,) kg.
    """
    now, places = np.array([time]), range(places_for(parameters))

    def targets(phase: float) -> Matrix:
        return np.array([path_to(parameters, slot, phase).states(now)[0] for slot in places])

    duration = parameters.reconfiguration_time or math.tau / parameters.mean_motion
    weights = None
    if parameters.assignment == "fuel":
        weights = fuel_weights(np.maximum(masses - np.array(parameters.dry_masses), LEAST_TANK))
    return assign_with_phase(transfer_costs(states, targets, duration, parameters.mean_motion), weights)
