"""Process noise that the truth's forces ask of a filter, beside the one that it has."""

from math import ceil, tau

import numpy as np

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.sil.scenario import Scenario
from formation_gnc.types import Matrix

POINTS = 120
"""Points of a revolution at which accelerations are compared."""


def unmodelled_density(plant: PlantParameters, deputy: str) -> float:
    """Power density (m^2/s^3) of the relative acceleration that a filter with J2 does not know.

    Over a revolution of chief and deputy, coasting from their start: the mean square on a Hill axis times the time in
    which it changes, its root mean square over that of its rate; of the axis where that is most. An acceleration
    turns with the orbit at the latest, in a radian.
    """
    body = plant.deputy[deputy]
    bodies = [plant.chief_body, body]
    chief = state_from_elements(plant.chief_elements)
    states = np.array([chief, inertial_from_relative(chief, np.array(body.relative_state))])
    step = tau / plant.mean_motion / POINTS
    truth = Propagator(step, ceil(step / plant.step), plant.forces, bodies, plant.epoch)
    model = Propagator(step)
    unknown = []
    for point in range(POINTS):
        time = point * step
        both = truth.acceleration(time, states) - model.acceleration(time, states)
        unknown.append(hill_rotation(states[0]) @ (both[1] - both[0]))
        try:
            states = truth.propagate(time, states, np.zeros((2, 3)))
        except ImpactError:
            break
    return _density(np.array(unknown), step, 1.0 / plant.mean_motion)


def _density(acceleration: Matrix, step: float, longest: float) -> float:
    """Power density of an acceleration, (N, 3), every `step` (s), that lasts for `longest` (s) at most."""
    squares = (acceleration**2).mean(axis=0)
    rates = (np.diff(acceleration, axis=0) ** 2).mean(axis=0) / step**2 if len(acceleration) > 1 else np.zeros(3)
    lasting = np.sqrt(np.divide(squares, rates, out=np.full(3, longest**2), where=rates > 0.0))
    return float((squares * np.minimum(lasting, longest)).max())


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
