"""When a satellite is in the Earth's shadow."""

import math

import numpy as np

from formation_gnc.orbit.propagation import Array, Propagator

PRECISION = 1e-3
"""Time (s) to which begin and end are found."""


def eclipses(state: Array, duration: float, step: float, epoch: float = 0.0) -> Array:
    """Begin and end of every eclipse that a satellite meets, coasting under J2 from now on.

    The plant's own shadow and its own rule: dark is where any of the Sun is hidden. One that is under way
    begins now; one that outlasts `duration` ends with it; one shorter than `step` may be missed.

    Args:
        state: inertial, (6,), m and m/s.
        duration: time to look ahead, s.
        step: s, between points of the orbit; a cubic joins them, 3 cm off at 1/180 of a revolution in LEO.
        epoch: now, Terrestrial Time since J2000.0, s.

    Returns:
        (N, 2), s from now, in the order of time.

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
        """When light turns to shadow or back between a point and the next."""
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


def _between(start: Array, end: Array, share: float, step: float) -> Array:
    """Position (3,) at a share of the step between two states: Hermite's cubic."""
    rest = 1.0 - share
    position: Array = rest * rest * ((1.0 + 2.0 * share) * start[:3] + share * step * start[3:]) + share * share * (
        (1.0 + 2.0 * rest) * end[:3] - rest * step * end[3:]
    )
    return position
