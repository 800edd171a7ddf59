"""Curvilinear relative coordinates: radial, along the orbit and across it, about the chief.

Hill's equations, and all linear models of relative motion, hold further out when their x is the difference of the
distances from the Earth's centre, their y the arc along the chief's orbit and their z the arc across it. A satellite
at the distance r + x, the angle y / r ahead in the orbit plane and the angle z / r above it is, in the Cartesian Hill
frame, at [(r + x) cos(y/r) cos(z/r) - r, (r + x) sin(y/r) cos(z/r), (r + x) sin(z/r)]. At a separation s both differ
by s^2 / 2r: 0.7 mm at 100 m in a low orbit, 3.5 km at 220 km.
"""

from math import asin, atan2, cos, hypot, sin, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel

Array = NDArray[np.float64]

KEPLER_ITERATIONS = 30
"""Newton steps on Kepler's equation, of which five or fewer are taken but for a nearly parabolic orbit."""


@inline
def _advanced_radius(chief: Array, ahead: float, mu: float) -> tuple[float, float]:
    """Distance (m) and its rate (m/s) on the chief's ellipse, a time (s) after its inertial state (6,)."""
    x, y, z, vx, vy, vz = chief[0], chief[1], chief[2], chief[3], chief[4], chief[5]
    radius = sqrt(x * x + y * y + z * z)
    outwards = x * vx + y * vy + z * vz
    if ahead == 0.0:
        return radius, outwards / radius
    inverse = 2.0 / radius - (vx * vx + vy * vy + vz * vz) / mu  # 1/a
    root = sqrt(mu * inverse)
    e_cos, e_sin = 1.0 - radius * inverse, outwards * inverse / root
    e = hypot(e_cos, e_sin)
    mean = atan2(e_sin, e_cos) - e_sin + root * inverse * ahead
    anomaly = mean + e * sin(mean) if e < 0.8 else mean + 0.85 * e * (1.0 if sin(mean) > 0.0 else -1.0)
    for _ in range(KEPLER_ITERATIONS):
        step = (anomaly - e * sin(anomaly) - mean) / (1.0 - e * cos(anomaly))
        anomaly -= step
        if abs(step) < 1e-12:
            break
    share = 1.0 - e * cos(anomaly)
    return share / inverse, root * e * sin(anomaly) / share


@kernel((ANY_MATRIX, ANY_VECTOR, ANY_VECTOR, numba.float64))
def hill_from_curvilinear(states: Array, chief: Array, ahead: Array, mu: float) -> Array:
    """Relative states in the Cartesian Hill frame, from curvilinear ones.

    Args:
        states: (N, 6), m and m/s.
        chief: inertial state on an ellipse, (6,), m and m/s.
        ahead: (N,) time of each state after the chief's, s.
        mu: gravitational parameter, m^3/s^2.

    Returns:
        (N, 6), m and m/s.
    """
    out = np.empty(states.shape)
    for k in range(len(states)):
        r, rate = _advanced_radius(chief, ahead[k], mu)
        x, y, z, vx, vy, vz = states[k, 0], states[k, 1], states[k, 2], states[k, 3], states[k, 4], states[k, 5]
        along, across = y / r, z / r
        along_rate, across_rate = (vy - rate * along) / r, (vz - rate * across) / r
        sine, cosine, sine_across, cosine_across = sin(along), cos(along), sin(across), cos(across)
        fallen_along, fallen_across = 2.0 * sin(0.5 * along) ** 2, 2.0 * sin(0.5 * across) ** 2
        fallen = fallen_along + fallen_across - fallen_along * fallen_across  # 1 - cos cos, without cancellation
        distance, outwards = r + x, rate + vx
        out[k, 0] = x - distance * fallen
        out[k, 1] = distance * sine * cosine_across
        out[k, 2] = distance * sine_across
        turned = sine * along_rate * cosine_across + cosine * sine_across * across_rate
        out[k, 3] = vx - outwards * fallen - distance * turned
        out[k, 4] = outwards * sine * cosine_across
        out[k, 4] += distance * (cosine * along_rate * cosine_across - sine * sine_across * across_rate)
        out[k, 5] = outwards * sine_across + distance * cosine_across * across_rate
    return out


@kernel((ANY_MATRIX, ANY_VECTOR, ANY_VECTOR, numba.float64))
def curvilinear_from_hill(states: Array, chief: Array, ahead: Array, mu: float) -> Array:
    """The inverse of `hill_from_curvilinear`, with angles within half a turn."""
    out = np.empty(states.shape)
    for k in range(len(states)):
        r, rate = _advanced_radius(chief, ahead[k], mu)
        x, y, z = r + states[k, 0], states[k, 1], states[k, 2]
        vx, vy, vz = rate + states[k, 3], states[k, 4], states[k, 5]
        in_plane = hypot(x, y)
        distance = hypot(in_plane, z)
        outwards = (x * vx + y * vy + z * vz) / distance
        along, across = atan2(y, x), asin(z / distance)
        along_rate = (x * vy - y * vx) / in_plane**2
        across_rate = (vz - z / distance * outwards) / in_plane
        out[k, 0] = (states[k, 0] * (r + x) + y * y + z * z) / (r + distance)  # distance - r, without cancellation
        out[k, 1], out[k, 2] = r * along, r * across
        out[k, 3] = outwards - rate
        out[k, 4], out[k, 5] = rate * along + r * along_rate, rate * across + r * across_rate
    return out
