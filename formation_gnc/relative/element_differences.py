"""First-order differences of the elements of two orbits, in Gim and Alfriend's variables.

A difference is (6,) of [a, lambda, i, q1, q2, Omega], with q1 = e cos(omega), q2 = e sin(omega) and the mean argument
of latitude lambda = M + omega; `sigma` takes the true one, theta, in its place. Regular at e = 0.
"""

import math

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.orbit.mean import secular_rates
from formation_gnc.relative.model import Array

LOWEST_INCLINATION = 1e-3
"""Inclination (rad) below which elements that refer to the node lose too many digits."""


def check_node(chief: Elements, what: str) -> None:
    """Raise OrbitError, in the name of `what`, for a chief within a milliradian of an equatorial orbit."""
    if math.sin(chief.inclination) < LOWEST_INCLINATION:
        raise OrbitError(
            f"inclination is {chief.inclination} rad: {what} need a node, "
            f"at least {LOWEST_INCLINATION} rad from an equatorial orbit"
        )


def sigma(orbit: Elements) -> Array:
    """(6, 6) map from differences of elements [a, theta, i, q1, q2, Omega] to the relative state.

    Joshi's Sigma(t) in (3.49), (3.50), after Gim and Alfriend's geometry, with q1 = e cos(omega),
    q2 = e sin(omega) and theta the true argument of latitude. Without J2, since the relative velocity excludes
    the tilt of the plane (`formation_gnc.orbit.frames`).
    """
    theta, q1, q2 = _latitude(orbit)
    sine, cosine = math.sin(theta), math.cos(theta)
    sin_i, cos_i = math.sin(orbit.inclination), math.cos(orbit.inclination)
    parameter = orbit.semi_major_axis * (1.0 - q1**2 - q2**2)
    speed = math.sqrt(MU / parameter)
    grown, slope = 1.0 + q1 * cosine + q2 * sine, q1 * sine - q2 * cosine
    radius = parameter / grown
    radial, transverse = speed * slope, speed * grown
    a, t, i, x1, x2, node = np.eye(6)
    of_parameter = a * parameter / orbit.semi_major_axis - 2.0 * orbit.semi_major_axis * (q1 * x1 + q2 * x2)
    of_grown = cosine * x1 + sine * x2 - slope * t
    of_slope = sine * x1 - cosine * x2 + (grown - 1.0) * t
    turn_x = cosine * i + sin_i * sine * node
    turn_y = -sine * i + sin_i * cosine * node
    turn_z = t + cos_i * node
    x = of_parameter / grown - radius / grown * of_grown
    of_radial = speed * of_slope - 0.5 * radial / parameter * of_parameter
    of_transverse = speed * of_grown - 0.5 * transverse / parameter * of_parameter
    return np.array(
        [
            x,
            radius * turn_z,
            -radius * turn_y,
            of_radial,
            of_transverse + radial * turn_z - transverse / radius * x,
            transverse * turn_x - radial * turn_y,
        ]
    )


def _latitude(orbit: Elements) -> tuple[float, float, float]:
    """True argument of latitude theta, q1 and q2."""
    e, omega = orbit.eccentricity, orbit.argument_of_perigee
    return omega + orbit.true_anomaly, e * math.cos(omega), e * math.sin(omega)


def true_from_mean_latitude(orbit: Elements) -> Array:
    """(6, 6) map from differences with the mean argument of latitude lambda to those with the true one."""
    theta, q1, q2 = _latitude(orbit)
    sine, cosine = math.sin(theta), math.cos(theta)
    eta = math.sqrt(1.0 - q1**2 - q2**2)
    e_cosine, e_sine = q1 * cosine + q2 * sine, q1 * sine - q2 * cosine
    kappa = (1.0 + eta + eta**2) / (1.0 + eta)
    by_q1 = (2.0 + e_cosine) * (sine - e_sine * q1 / (1.0 + eta)) + kappa * q2
    by_q2 = -(2.0 + e_cosine) * (cosine + e_sine * q2 / (1.0 + eta)) - kappa * q1
    matrix = np.eye(6)
    matrix[1, [1, 3, 4]] = np.array([(1.0 + e_cosine) ** 2, by_q1, by_q2]) / eta**3
    return matrix


def secular_slopes(mean: Elements) -> Array:
    """(6, 6) derivatives of the secular rates of [a, lambda, i, omega, -, Omega] by the mean elements."""
    a, i = mean.semi_major_axis, mean.inclination
    _, q1, q2 = _latitude(mean)
    eta = math.sqrt(1.0 - q1**2 - q2**2)
    n, s, cosine = mean.mean_motion, math.sin(i) ** 2, math.cos(i)
    rate = 1.5 * J2 * (EARTH_RADIUS / (a * eta**2)) ** 2 * n
    perigee, anomaly = 2.0 - 2.5 * s, 1.0 - 1.5 * s
    by_s = 2.0 * math.sin(i) * cosine
    slopes = np.zeros((6, 6))
    slopes[3, 0] = -3.5 * rate / a * perigee
    slopes[3, 2] = -2.5 * rate * by_s
    slopes[5, 0] = 3.5 * rate / a * cosine
    slopes[5, 2] = rate * math.sin(i)
    slopes[1, 0] = -1.5 * n / a - 3.5 * rate / a * (perigee + eta * anomaly)
    slopes[1, 2] = -(2.5 + 1.5 * eta) * rate * by_s
    for column, q in ((3, q1), (4, q2)):
        slopes[3, column] = 4.0 * rate * q / eta**2 * perigee
        slopes[5, column] = -4.0 * rate * q / eta**2 * cosine
        slopes[1, column] = slopes[3, column] + 3.0 * rate * q / eta * anomaly
    return slopes


def secular_transition(mean: Elements, duration: float) -> Array:
    """(6, 6) transition matrix of differences of mean elements."""
    _, q1, q2 = _latitude(mean)
    turn = secular_rates(mean)[1] * duration
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    q1, q2 = rotation @ [q1, q2]
    slopes = secular_slopes(mean) * duration
    transition = np.eye(6)
    transition[[1, 5]] += slopes[[1, 5]]
    transition[3:5, 3:5] = rotation
    transition[3:5] += np.outer([-q2, q1], slopes[3])
    return transition
