"""Constants of a prediction step, which depend on its length alone."""

from dataclasses import dataclass

from formation_gnc.navigation.process import process_noise, substeps
from formation_gnc.types import NANOSECONDS, Matrix

CHIEF_DISTANCE, CHIEF_SPEED = 100.0, 1.0
"""Largest accepted chief-ephemeris residual per tick, m and m/s; in proportion for ticks below a second."""


@dataclass(frozen=True, slots=True)
class StepConstants:
    """Length of a step, and what follows from it."""

    nanoseconds: int
    seconds: float
    substeps: int
    chief_distance: float
    """Largest accepted chief-ephemeris residual, m."""
    chief_speed: float
    """The same of the velocity, m/s."""
    noise: Matrix
    """(6, 6) process noise."""


def step_constants(nanoseconds: int, density: float) -> StepConstants:
    """Constants of a step with process noise of a density, m^2/s^3."""
    seconds = nanoseconds / NANOSECONDS
    share = min(1.0, seconds)
    return StepConstants(
        nanoseconds,
        seconds,
        substeps(seconds),
        CHIEF_DISTANCE * share,
        CHIEF_SPEED * share,
        process_noise(density, seconds),
    )
