"""Eclipse forecast: passages of a satellite through the Earth's shadow."""

import math

import numpy as np

from formation_gnc.orbit.propagation import Array, Propagator

PRECISION = 1e-3
"""Precision of begin and end, s."""


def eclipses(state: Array, duration: float, step: float, epoch: float = 0.0) -> Array:
    """Begin and end of every eclipse of a satellite that coasts under J2.

    Same shadow as in the plant: an eclipse lasts while any of the Sun's disc is hidden. An eclipse in progress
    begins now; one that outlasts `duration` ends with it; one shorter than `step` may be missed.

    Args:
        state: inertial, (6,), m and m/s.
        duration: length of the forecast, s.
        step: interval of the propagated states, s; a cubic in between is within 3 cm at 1/180 of a revolution in
            LEO.
        epoch: now, Terrestrial Time since J2000.0, s.

    Returns:
        (N, 2), s from now, in order of time.

    Raises:
        ImpactError: the orbit meets the Earth.
    """
    count = math.ceil(duration / step)
    step = duration / count
    propagator = Propagator(step, epoch=epoch)
    states = [np.array(state, dtype=np.float64)]
    for index in range(count):
        states.append(propagator.propagate(index * step, states[-1][None], np.zeros((1, 3)))[0])
    dark = [propagator.illumination(index * step, each) < 1.0 for index, each in enumerate(states)]

    def crossing(index: int) -> float:
        """Time of the shadow's edge between a point and the next, by bisection."""
        first, last = 0.0, step
        while last - first > PRECISION:
            middle = 0.5 * (first + last)
            position = _between(states[index], states[index + 1], middle / step, step)
            is_dark = propagator.illumination(index * step + middle, position) < 1.0
            first, last = (middle, last) if is_dark == dark[index] else (first, middle)
        return index * step + last

    bounds = [crossing(index) for index in range(count) if dark[index] != dark[index + 1]]
    if dark[0]:
        bounds.insert(0, 0.0)
    if dark[-1]:
        bounds.append(duration)
    return np.array(bounds).reshape(-1, 2)


def _between(start: Array, end: Array, fraction: float, step: float) -> Array:
    """Position (3,) at a fraction of the step between two states: Hermite's cubic."""
    rest = 1.0 - fraction
    of_start = (1.0 + 2.0 * fraction) * start[:3] + fraction * step * start[3:]
    of_end = (1.0 + 2.0 * rest) * end[:3] - rest * step * end[3:]
    position: Array = rest * rest * of_start + fraction * fraction * of_end
    return position
