"""Thrust that it takes to follow a target path in the plant's forces, beside the one that there is."""

from dataclasses import dataclass
from math import ceil, tau

import numpy as np

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.sil.scenario import Scenario
from formation_gnc.sil.target_path import target_path
from formation_gnc.types import Vector

POINTS = 60
"""Points of a revolution at which the path is compared with free motion."""

SPAN = 1.0 / 600.0
"""Time over which they are compared, in revolutions: a hundredth of a radian, in which no force turns."""


@dataclass(frozen=True)
class PathDemand:
    """Acceleration that a target path takes over a revolution."""

    peak: Vector
    """(3,) largest on each Hill axis, m/s^2."""
    delta_v: float
    """Of all axes, m/s."""


def path_demand(scenario: Scenario, deputy: str) -> PathDemand:
    """What a deputy's target path takes: the velocity by which free motion from the path leaves it.

    The path is as guidance has it from the chief's true state, anchored anew at every tick; free motion is that of
    the plant's forces.
    """
    plant = scenario.plant
    revolution = tau / plant.mean_motion
    span = revolution * SPAN
    bodies = [plant.chief_body, plant.deputy[deputy]]
    truth = Propagator(span, ceil(span / plant.step), plant.forces, bodies, plant.epoch)
    demands = []
    for time, chief, path in target_path(scenario, deputy, POINTS):
        aim = path.states(np.array([time]))[0]
        start = np.array([chief, inertial_from_relative(chief, aim)])
        try:
            now = truth.propagate(time, start, np.zeros((2, 3)))
        except ImpactError:
            break
        later = path.anchored(now[0], time + span).states(np.array([time + span]))[0]
        demands.append((later - relative_from_inertial(now[0], now[1]))[3:] / span)
    taken = np.abs(demands) if demands else np.zeros((1, 3))
    return PathDemand(taken.max(axis=0), float(taken.mean(axis=0).sum()) * revolution)


def path_demand_warnings(scenario: Scenario) -> list[str]:
    """A line for each deputy whose thrusters are too weak for its target path."""
    warnings = []
    for deputy, modules in scenario.deputies.items():
        controller, model = modules["controller"], modules["guidance"].model
        if controller.algorithm == "coast":
            continue
        demand, limit = path_demand(scenario, deputy), np.array(controller.thrust_limit)
        force = scenario.plant.deputy[deputy].mass * demand.peak
        worst = int(np.argmax(np.where(limit > 0.0, force - limit, -np.inf)))
        if force[worst] > limit[worst]:
            warnings.append(
                f"/{deputy}/guidance: to follow the target takes up to {force[worst]:.2g} N on the "
                f"{('radial', 'along-track', 'cross-track')[worst]} axis, which has {limit[worst]:.2g} N, and "
                f"{demand.delta_v:.2g} m/s a revolution: the model {model} leaves out that much of the plant's forces; "
                "another model, a smaller formation or more thrust would do"
            )
    return warnings
