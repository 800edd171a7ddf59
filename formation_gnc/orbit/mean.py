"""Mean elements: osculating ones without the short-period perturbations of J2.

Brouwer's first-order theory as a Lie transformation: osculating states are the mean ones after unit time along
the flow of a generating function W, with ``n dW/dl = H1 - <H1>`` for the J2 part H1 of the energy and its mean
over the mean anomaly l. In position and velocity it has no singularity at circular or equatorial orbits, and the
flow is reversible, so the transformation inverts to rounding error. Long-period terms are kept, which avoids the
singularity at the critical inclination.

Derivation: docs/theory/orbits.md.
"""

from dataclasses import replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    state_from_elements,
    true_from_mean_anomaly,
    wrap,
)

Array = NDArray[np.float64]


def mean_elements(osculating: Elements) -> Elements:
    """Mean elements under J2, which drift at `secular_rates` up to terms of order J2 squared.

    Args:
        osculating: Keplerian elements.
    """
    return elements_from_state(mean_state(state_from_elements(osculating)))


def osculating_elements(mean: Elements) -> Elements:
    """Osculating elements: the inverse of `mean_elements`."""
    return elements_from_state(osculating_state(state_from_elements(mean)))


def mean_state(osculating: Array) -> Array:
    """Inertial states of the mean orbits, (..., 6), of osculating inertial states, (..., 6), m and m/s."""
    return _flow(osculating, -1.0)


def osculating_state(mean: Array) -> Array:
    """Osculating inertial states, (..., 6), of the mean orbits' inertial states, (..., 6), m and m/s."""
    return _flow(mean, 1.0)


def secular_rates(mean: Elements) -> tuple[float, float, float]:
    """Mean rates of right ascension, argument of perigee and mean anomaly under J2, rad/s.

    Args:
        mean: mean elements.
    """
    n, cos_i = mean.mean_motion, np.cos(mean.inclination)
    eta = sqrt(1.0 - mean.eccentricity**2)
    strength = 0.75 * n * J2 * (EARTH_RADIUS / (mean.semi_major_axis * eta**2)) ** 2
    return (
        float(-2.0 * strength * cos_i),
        float(strength * (5.0 * cos_i**2 - 1.0)),
        float(n + strength * eta * (3.0 * cos_i**2 - 1.0)),
    )


def advanced(mean: Elements, duration: float) -> Elements:
    """Mean elements after a duration (s) at their secular rates under J2."""
    node, perigee, anomaly = (rate * duration for rate in secular_rates(mean))
    e = mean.eccentricity
    return replace(
        mean,
        right_ascension=wrap(mean.right_ascension + node),
        argument_of_perigee=wrap(mean.argument_of_perigee + perigee),
        true_anomaly=true_from_mean_anomaly(mean.mean_anomaly + anomaly, e),
    )


def _generating_function(states: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """W of states (6, ...), m^2/s; analytic, for differentiation by complex steps."""
    rx, ry, rz, vx, vy, vz = states
    r = np.sqrt(rx * rx + ry * ry + rz * rz)
    h = np.sqrt((ry * vz - rz * vy) ** 2 + (rz * vx - rx * vz) ** 2 + (rx * vy - ry * vx) ** 2)
    radial = (rx * vx + ry * vy + rz * vz) / r
    a = 1.0 / (2.0 / r - (vx * vx + vy * vy + vz * vz) / MU)
    root = np.sqrt(MU * a)
    e_sin_f, e_cos_f = h * radial / MU, h * h / (MU * r) - 1.0
    e_sin_anomaly, e_cos_anomaly = r * radial / root, 1.0 - r / a
    centre = 2.0 * np.arctan(e_sin_anomaly / (1.0 + h / root - e_cos_anomaly)) + e_sin_anomaly  # f - l
    up, ahead = rz / r, (vz - radial * rz / r) * r / h  # sin i sin u and sin i cos u
    double_sine, double_cosine = 2.0 * up * ahead, ahead * ahead - up * up  # sin^2 i times sin 2u and cos 2u
    w: NDArray[np.complex128] = (0.5 * MU**2 * J2 * EARTH_RADIUS**2 / h**3) * (
        (1.5 * (up * up + ahead * ahead) - 1.0) * (centre + e_sin_f)
        - double_sine * (0.75 + e_cos_f)
        + 0.5 * double_cosine * e_sin_f
    )
    return w


def _velocity(state: Array) -> Array:
    """Hamiltonian vector field of W at states (..., 6)."""
    steps = 1e-30 * np.array([1e7, 1e7, 1e7, 1e4, 1e4, 1e4])
    slopes = _generating_function(np.moveaxis(state[..., None] + 1j * np.diag(steps), -2, 0)).imag / steps
    return np.concatenate((slopes[..., 3:], -slopes[..., :3]), axis=-1)


def _flow(state: Array, duration: float) -> Array:
    """States after a time along the flow, by two classical Runge-Kutta steps: errors are of order J2^5."""
    now, step = np.array(state, dtype=np.float64), 0.5 * duration
    for _ in range(2):
        first = _velocity(now)
        second = _velocity(now + 0.5 * step * first)
        third = _velocity(now + 0.5 * step * second)
        fourth = _velocity(now + step * third)
        now = now + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
    return now
