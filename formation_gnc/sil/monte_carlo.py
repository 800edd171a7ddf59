"""Monte Carlo samples for the navigation filter: their truth is exactly as uncertain as its parameters say.

How consistent it is in flown scenarios, whose plant has errors of its own, is a requirement of a campaign.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np

from formation_gnc.navigation.navigation_filter import NavigationFilter
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.navigation.process import substeps
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import Estimate, Measurement, Reading
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import Vector

DEPUTY = "deputy1"

START = np.array([10.0, -90.0, 10.0, 0.0, 0.0, 0.0])
"""Relative state at the start of the default scenario."""

_NO_ACCELERATION = np.zeros(3)
_NO_FIX = np.zeros(6)


@dataclass(frozen=True, slots=True)
class Sample:
    """Truth and measurement at a tick."""

    truth: Vector
    """(6,) relative state."""
    measurement: Measurement


def simulate_measurements(
    parameters: NavigationParameters,
    ticks: int,
    random: np.random.Generator,
    force: Vector = _NO_ACCELERATION,
    start: Vector = START,
    mass: float = 100.0,
) -> Iterator[Sample]:
    """Simulate a run: at every tick a reading of each sensor that the parameters use, at the first a fix.

    Args:
        parameters: orbit, tick, and the statistics of fix, process and readings.
        ticks: number of samples.
        random: source of all noise.
        force: of the thrusters, known to the filter, Hill frame, (3,), N.
        start: relative state at the start, (6,).
        mass: kg.
    """
    chief = state_from_elements(Elements(**vars(parameters.chief)))
    states = np.array([chief, inertial_from_relative(chief, start)])
    propagator = Propagator(parameters.tick, substeps(parameters.tick))
    fix_sigma = np.repeat([parameters.fix_position_sigma, parameters.fix_velocity_sigma], 3)
    jitter = sqrt(parameters.acceleration_density / parameters.tick)
    for tick in range(ticks):
        chief, deputy = states
        relative = relative_from_inertial(chief, deputy)
        yield Sample(
            relative,
            Measurement(
                time=tick * parameters.tick_ns,
                deputy=DEPUTY,
                chief_state=chief,
                readings=_readings(parameters, deputy, chief, random),
                applied_force=force if tick else _NO_ACCELERATION,
                mass=mass,
                eclipse=False,
                fix_available=tick == 0,
                fix=relative + fix_sigma * random.standard_normal(6) if tick == 0 else _NO_FIX,
            ),
        )
        # White acceleration held over a tick adds the covariance of the process noise.
        thrust = force @ hill_rotation(chief) / mass + jitter * random.standard_normal(3)
        states = propagator.propagate(tick * parameters.tick, states, np.array([_NO_ACCELERATION, thrust]))


def _readings(
    parameters: NavigationParameters, deputy: Vector, chief: Vector, random: np.random.Generator
) -> list[Reading]:
    readings = []
    for name, sigmas in parameters.sigmas.items():
        truth = sensors()[name].measure(deputy.tolist(), chief.tolist())
        values = [value + sigma * random.standard_normal() for value, sigma in zip(truth, sigmas, strict=True)]
        readings.append(Reading(name, values, 0))
    return readings


def navigation_filter(parameters: NavigationParameters) -> NavigationFilter:
    """Filter of the deputy that the samples are of."""
    return NavigationFilter(f"/{DEPUTY}/navigation", parameters)


def nees(estimate: Estimate, truth: Vector) -> float:
    """Normalised estimation error squared (NEES): 6 on average for a consistent filter."""
    error = estimate.relative_state - truth
    return float(error @ np.linalg.solve(estimate.covariance, error))
