"""Arithmetic of relative-motion models, compiled."""

from math import sqrt

import numpy as np
from numba import float64, types
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS, J2
from formation_gnc.orbit.jit import ANY_VECTOR, kernel
from formation_gnc.relative.chief import ChiefState

Array = NDArray[np.float64]


def motion(state: Array, acceleration: Array, chief: ChiefState, oblate: bool) -> tuple[Array, Array]:
    """Rate of change (6,) of a relative state (6,) and its Jacobian (6, 6), with J2 or without.

    The equations of `OblateModel` and `NonlinearModel`. Point-mass gravity is free of cancellation; J2, a
    thousandth of it, is not.
    """
    strength = 1.5 * J2 * chief.mu * EARTH_RADIUS**2 if oblate else 0.0
    frame = np.array(
        [chief.mu, chief.radius, chief.angular_rate, chief.angular_acceleration, chief.tilt_rate, strength]
    )
    joint: Array = _motion(np.asarray(state, dtype=np.float64), acceleration, frame, chief.pole)
    return joint[:, 6], joint[:, :6]


@kernel(float64[:, ::1](ANY_VECTOR, ANY_VECTOR, ANY_VECTOR, ANY_VECTOR))
def _motion(state: Array, acceleration: Array, frame: Array, pole: Array) -> Array:
    """(6, 7) Jacobian, and the rate of change as its last column."""
    mu, radius, rate, change, tilt, strength = frame
    joint = np.zeros((6, 7))
    for axis in range(3):
        joint[axis, 3 + axis] = 1.0
    joint[1, 2] = joint[4, 5] = tilt
    joint[2, 1] = joint[5, 4] = -tilt
    joint[3, 0] = joint[4, 1] = rate * rate
    joint[3, 1], joint[4, 0] = change, -change
    joint[3, 4], joint[4, 3] = 2.0 * rate, -2.0 * rate
    joint[3, 2], joint[5, 0] = rate * tilt, -rate * tilt
    for row in range(6):
        for column in range(6):
            joint[row, 6] += joint[row, column] * state[column]
    place = np.array([radius + state[0], state[1], state[2]])
    square = place[0] ** 2 + place[1] ** 2 + place[2] ** 2
    distance = sqrt(square)
    # mu r / r^3 - mu p / d^3, with d^2 = r^2 (1 + q) and d^3 / r^3 - 1 = q (3 + 3 q + q^2) / (1 + d^3 / r^3)
    q = (state[0] * (2.0 * radius + state[0]) + state[1] ** 2 + state[2] ** 2) / radius**2
    growth = q * (3.0 + 3.0 * q + q * q) / (1.0 + (distance / radius) ** 3)
    central = mu / (square * distance)
    height = place[0] * pole[0] + place[1] * pole[1] + place[2] * pole[2]
    sine = height / distance
    pull = strength / (square * square * distance)
    for i in range(3):
        outward = radius if i == 0 else 0.0
        joint[3 + i, 6] += acceleration[i] - central * (state[i] - growth * outward)
        # J2 of the deputy less that of the chief: -K { p / d^5 - 5 Z^2 p / d^7 + 2 Z k / d^5 }
        there = (1.0 - 5.0 * sine**2) * place[i] + 2.0 * height * pole[i]
        here = (1.0 - 5.0 * pole[0] ** 2) * outward + 2.0 * radius * pole[0] * pole[i]
        joint[3 + i, 6] -= pull * there - strength / radius**5 * here
        for j in range(3):
            outer = place[i] * place[j] / square
            cross = (place[i] * pole[j] + pole[i] * place[j]) / distance
            same = 1.0 if i == j else 0.0
            joint[3 + i, j] += central * (3.0 * outer - same) - pull * (
                (1.0 - 5.0 * sine**2) * same
                + 5.0 * (7.0 * sine**2 - 1.0) * outer
                - 10.0 * sine * cross
                + 2.0 * pole[i] * pole[j]
            )
    return joint


@kernel((ANY_VECTOR, ANY_VECTOR, ANY_VECTOR, float64[::1]))
def sine_lag(angle: Array, square: Array, sine: Array, out: Array) -> None:
    """Fill in a - sin a for angles a (N,), without cancellation, from their squares and sines (N,)."""
    for k in range(len(angle)):
        a, aa = angle[k], square[k]
        series = a * aa / 6.0 * (1.0 - aa / 20.0 * (1.0 - aa / 42.0 * (1.0 - aa / 72.0)))
        out[k] = series if abs(a) < 0.1 else a - sine[k]


@kernel((float64[:, :, ::1], *(types.UniTuple(float64, 3),) * 2, *(ANY_VECTOR,) * 7))
def harmonic_transition(
    out: Array,
    frequencies: tuple[float, float, float],
    powers: tuple[float, float, float],
    time: Array,
    sine: Array,
    cosine: Array,
    versine: Array,
    lag: Array,
    normal_sine: Array,
    normal_cosine: Array,
) -> None:
    """Fill in transition matrices (N, 6, 6) of `formation_gnc.relative.hill.HarmonicModel`.

    Args:
        out: written.
        frequencies: w, q and p, rad/s.
        powers: w^2, q^2 and q^3.
        time: durations t (N,), s.
        sine: sin q t, (N,); `cosine`, `versine` (1 - cos) and `lag` (q t - sin q t) likewise.
        cosine: see above.
        versine: see above.
        lag: see above.
        normal_sine: sin p t, (N,).
        normal_cosine: cos p t, (N,).
    """
    w, q, p = frequencies
    ww, qq, qqq = powers
    twice = 2.0 * w
    g = 4.0 * ww - qq
    out[:] = 0.0
    for k in range(len(time)):
        phi = out[k]
        phi[0, 0] = 1.0 + g * versine[k] / qq
        phi[0, 3] = sine[k] / q
        phi[0, 4] = twice * versine[k] / qq
        phi[1, 0] = -twice * g * lag[k] / qqq
        phi[1, 1] = 1.0
        phi[1, 3] = -phi[0, 4]
        phi[1, 4] = time[k] - 4.0 * ww * lag[k] / qqq
        phi[2, 2] = normal_cosine[k]
        phi[2, 5] = normal_sine[k] / p
        phi[3, 0] = g * sine[k] / q
        phi[3, 3] = cosine[k]
        phi[3, 4] = twice * sine[k] / q
        phi[4, 0] = -twice * g * versine[k] / qq
        phi[4, 3] = -phi[3, 4]
        phi[4, 4] = 1.0 - 4.0 * ww * versine[k] / qq
        phi[5, 2] = -p * normal_sine[k]
        phi[5, 5] = normal_cosine[k]
