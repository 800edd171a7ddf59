"""Orbits into dense air and the ground, for tests of the integrator and of the air."""

import re

import numpy as np

from formation_gnc.errors import ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.propagation import Propagator, propagate_with_transition


def fall(propagator: Propagator, radius: float, tick: float) -> tuple[float, float, list[float]]:
    """Time (s), longitude (deg) and inertial state at which a circular orbit about the equator in dense air ends."""
    states, time = np.array([[radius, 0.0, 0.0, 0.0, np.sqrt(MU / radius), 0.0]]), 0.0
    message = ""
    while not message:
        try:
            states = propagator.propagate(time, states, np.zeros((1, 3)))
        except ImpactError as error:
            message = str(error)
        assert np.linalg.norm(states[0, :3]) < radius + 10e3
        time += tick
    found = re.search(r"at ([\d.]+) s, latitude .* longitude ([-\d.]+) deg: state \[(.*)\]$", message)
    assert found is not None, message
    return float(found[1]), float(found[2]), [float(each) for each in found[3].split(",")]


def about_perigee(depth: float, before: float) -> np.ndarray:
    """State (1, 6) a time (s) before an equatorial perigee that lies so deep (m) below the surface."""
    perigee, apogee = EARTH_RADIUS - depth, EARTH_RADIUS + 1000e3
    speed = np.sqrt(2.0 * MU * (1.0 / perigee - 1.0 / (perigee + apogee)))
    state = np.array([perigee, 0.0, 0.0, 0.0, speed, 0.0])
    return propagate_with_transition(state, np.zeros(3), -before, 60)[0][None]
