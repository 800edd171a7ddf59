"""Process noise that the truth's forces ask of a filter, beside the one that it has."""

from math import ceil, tau

import numpy as np

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.sil.scenario import Scenario

POINTS = 120
"""Points of a revolution at which accelerations are compared."""


def unmodelled_density(plant: PlantParameters, deputy: str) -> float:
    """Power density (m^2/s^3) of the relative acceleration that a filter with J2 does not know.

    Over a revolution of chief and deputy, coasting from their start: the largest mean square on one Hill axis, times
    the time in which such an acceleration turns with the orbit, a radian.
    """
    body = plant.deputy[deputy]
    bodies = [plant.chief_body, body]
    chief = state_from_elements(plant.chief_elements)
    states = np.array([chief, inertial_from_relative(chief, np.array(body.relative_state))])
    step = tau / plant.mean_motion / POINTS
    truth = Propagator(step, ceil(step / plant.step), plant.forces, bodies, plant.epoch)
    model = Propagator(step)
    squares, points = np.zeros(3), 0
    for point in range(POINTS):
        time = point * step
        unknown = truth.acceleration(time, states) - model.acceleration(time, states)
        squares += (hill_rotation(states[0]) @ (unknown[1] - unknown[0])) ** 2
        points += 1
        try:
            states = truth.propagate(time, states, np.zeros((2, 3)))
        except ImpactError:
            break
    return float(squares.max()) / points / plant.mean_motion


def process_noise_warnings(scenario: Scenario) -> list[str]:
    """A line for each deputy whose filter has less process noise than the truth's unmodelled forces make."""
    warnings = []
    for name, modules in scenario.deputies.items():
        given, least = modules["navigation"].acceleration_density, unmodelled_density(scenario.plant, name)
        if given < least:
            warnings.append(
                f"/{name}/navigation: acceleration_density is {given:.1e} m^2/s^3; the plant's forces that the filter "
                f"does not know make about {least:.1e} m^2/s^3, and its covariance will be too small"
            )
    return warnings
