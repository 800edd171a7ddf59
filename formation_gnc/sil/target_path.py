"""The path that a deputy's target takes in a revolution, beside its chief."""

from collections.abc import Iterator
from math import ceil, tau

import numpy as np

from formation_gnc.errors import ImpactError
from formation_gnc.guidance.slots import design_path
from formation_gnc.guidance.targets import TargetPath
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.sil.scenario import Scenario
from formation_gnc.types import Vector


def target_path(scenario: Scenario, deputy: str, points: int) -> Iterator[tuple[float, Vector, TargetPath]]:
    """Time (s), the chief's true state (6,) and the path as guidance has it from that, at points of a revolution.

    It ends early where the chief comes down.
    """
    plant = scenario.plant
    path = design_path(scenario.deputies[deputy]["guidance"])
    step = tau / plant.mean_motion / points
    onward = Propagator(step, ceil(step / plant.step), plant.forces, [plant.chief_body], plant.epoch)
    chief = state_from_elements(plant.chief_elements)
    for time in (step * np.arange(points)).tolist():
        yield time, chief, path.anchored(chief, time)
        try:
            (chief,) = onward.propagate(time, chief[None], np.zeros((1, 3)))
        except ImpactError:
            return
