"""Process noise that the truth's forces ask of a filter, beside the one that it has."""

from math import tau

import numpy as np

from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.sil.scenario import Scenario
from formation_gnc.sil.target_path import target_path
from formation_gnc.types import Matrix

POINTS = 120
"""Points of a revolution at which accelerations are compared."""


def unmodelled_density(scenario: Scenario, deputy: str) -> float:
    """Power density (m^2/s^3) of the relative acceleration that a filter with J2 does not know.

    Over a revolution of the chief and the deputy's target: the mean square on a Hill axis times the time in which it
    changes, its root mean square over that of its rate; of the axis where that is most. An acceleration turns with
    the orbit at the latest, in a radian.
    """
    plant = scenario.plant
    step = tau / plant.mean_motion / POINTS
    truth = Propagator(step, forces=plant.forces, bodies=[plant.chief_body, plant.deputy[deputy]], epoch=plant.epoch)
    model = Propagator(step)
    unknown = []
    for time, chief, path in target_path(scenario, deputy, POINTS):
        states = np.array([chief, inertial_from_relative(chief, path.states(np.array([time]))[0])])
        both = truth.acceleration(time, states) - model.acceleration(time, states)
        unknown.append(hill_rotation(chief) @ (both[1] - both[0]))
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
        given, least = modules["navigation"].acceleration_density, unmodelled_density(scenario, name)
        if given < least:
            warnings.append(
                f"/{name}/navigation: acceleration_density is {given:.1e} m^2/s^3; the plant's forces that the filter "
                f"does not know make about {least:.1e} m^2/s^3, and its covariance will be too small"
            )
    return warnings
