"""Flights to try a filter on: a truth exactly as uncertain as the filter's parameters say it is.

What Monte Carlo campaigns and tests of consistency are made of. The plant of a scenario is another thing:
its errors are what the scenario says, whatever the filter believes.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np

from formation_gnc.navigation.measurement import NAMES
from formation_gnc.navigation.navigation_filter import NavigationFilter, NavigationParameters
from formation_gnc.navigation.process import substeps
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.plant.sensors import read
from formation_gnc.records import Estimate, Measurement, Reading, Sensor
from formation_gnc.types import Vector

DEPUTY = "deputy1"

START = np.array([10.0, -90.0, 10.0, 0.0, 0.0, 0.0])
"""Relative state at the start of the default scenario."""

_AT_REST = np.zeros(3)
_NO_FIX = np.zeros(6)


@dataclass(frozen=True, slots=True)
class Sample:
    """A tick of a rehearsal."""

    truth: Vector
    """(6,) relative state."""
    measurement: Measurement


def simulate_measurements(
    parameters: NavigationParameters,
    ticks: int,
    random: np.random.Generator,
    force: Vector = _AT_REST,
    start: Vector = START,
    mass: float = 100.0,
) -> Iterator[Sample]:
    """Fly, and measure with every sensor that the parameters use at every tick, with a fix at the first.

    Args:
        parameters: orbit, tick, and the statistics of fix, process and readings.
        ticks: how many samples.
        random: for all of these.
        force: of the thrusters, known to the filter, Hill frame, (3,), N.
        start: relative state at the start, (6,).
        mass: kg.
    """
    chief = state_from_elements(Elements(**vars(parameters.chief)))
    states = np.array([chief, inertial_from_relative(chief, start)])
    propagator = Propagator(parameters.tick, substeps(parameters.tick))
    sensors = [sensor for sensor in Sensor if NAMES[sensor] in parameters.sensors]
    sigmas = [getattr(parameters, f"{NAMES[sensor]}_sigma") for sensor in sensors]
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
                readings=[
                    Reading(NAMES[sensor], [read(sensor, deputy, chief) + sigma * random.standard_normal()], 0)
                    for sensor, sigma in zip(sensors, sigmas, strict=True)
                ],
                applied_force=force if tick else _AT_REST,
                mass=mass,
                eclipse=False,
                fix_available=tick == 0,
                fix=relative + fix_sigma * random.standard_normal(6) if tick == 0 else _NO_FIX,
            ),
        )
        # White acceleration held over a tick: it adds what the process noise adds.
        thrust = force @ hill_rotation(chief) / mass + jitter * random.standard_normal(3)
        states = propagator.propagate(tick * parameters.tick, states, np.array([_AT_REST, thrust]))


def navigator(parameters: NavigationParameters) -> NavigationFilter:
    """The filter that a rehearsal's measurements are for."""
    return NavigationFilter(f"/{DEPUTY}/navigation", parameters)


def nees(estimate: Estimate, truth: Vector) -> float:
    """Normalised estimation error squared: six on average when the covariance is right."""
    error = estimate.relative_state - truth
    return float(error @ np.linalg.solve(estimate.covariance, error))
