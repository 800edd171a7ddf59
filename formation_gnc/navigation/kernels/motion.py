"""Motion of the deputy beside the chief: point mass with J2, and held thrust."""

from math import sqrt

import numpy as np
from numba import float64, int64

from formation_gnc.navigation.kernels.linear_algebra import WRITABLE_MATRIX, WRITABLE_VECTOR, congruence, product
from formation_gnc.orbit.frames import hill_frame, to_inertial, to_relative
from formation_gnc.orbit.gravity import oblate_acceleration
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.orbit.runge_kutta import COUPLING, STAGES, WEIGHTS
from formation_gnc.types import Matrix, Vector


@inline
def hill_transform(axes: Matrix, rate: float) -> Matrix:
    """`formation_gnc.orbit.frames.hill_transform` for use inside kernels."""
    out = np.zeros((6, 6))
    for i in range(3):
        for c in range(3):
            out[i, c] = out[3 + i, 3 + c] = axes[i, c]
    for c in range(3):
        out[3, c] = rate * axes[1, c]
        out[4, c] = -rate * axes[0, c]
    return out


@inline
def hill_transform_inverse(axes: Matrix, rate: float) -> Matrix:
    """`formation_gnc.orbit.frames.hill_transform_inverse` for use inside kernels."""
    out = np.zeros((6, 6))
    for i in range(3):
        for c in range(3):
            out[c, i] = out[3 + c, 3 + i] = axes[i, c]
    for c in range(3):
        out[3 + c, 0] = rate * axes[1, c]
        out[3 + c, 1] = -rate * axes[0, c]
    return out


@inline
def _coast(state: Vector, ax: float, ay: float, az: float, duration: float, substeps: int) -> Vector:
    """`propagate_with_transition` without the transition."""
    step = duration / substeps
    now = state.copy()
    rates = np.empty((STAGES, 6))
    stage = np.empty(6)
    for _ in range(substeps):
        for i in range(STAGES):
            for c in range(6):
                change = 0.0
                for j in range(i):
                    change += COUPLING[i, j] * rates[j, c]
                stage[c] = now[c] + step * change
            gx, gy, gz = oblate_acceleration(stage[0], stage[1], stage[2])
            rates[i, 0], rates[i, 1], rates[i, 2] = stage[3], stage[4], stage[5]
            rates[i, 3], rates[i, 4], rates[i, 5] = gx + ax, gy + ay, gz + az
        for c in range(6):
            change = 0.0
            for i in range(STAGES):
                change += WEIGHTS[i] * rates[i, c]
            now[c] += step * change
    return now


@inline
def _inertial(axes: Matrix, acceleration: Vector) -> Vector:
    """Inertial components (3,) of an acceleration along the Hill axes."""
    out = np.empty(3)
    for c in range(3):
        out[c] = acceleration[0] * axes[0, c] + acceleration[1] * axes[1, c] + acceleration[2] * axes[2, c]
    return out


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64))
def coast(state: Vector, acceleration: Vector, duration: float, substeps: int) -> Vector:
    """State (6,) after a duration (s, either sign) under a held inertial acceleration (3,)."""
    return _coast(state, acceleration[0], acceleration[1], acceleration[2], duration, substeps)


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64, float64, float64))
def ephemeris_agrees(
    chief: Vector, ephemeris: Vector, duration: float, substeps: int, distance: float, speed: float
) -> bool:
    """Whether the chief's ephemeris is within tolerance of the propagated chief.

    Args:
        chief: inertial state at the start, (6,), m and m/s.
        ephemeris: the same at the end, (6,), by the ephemeris.
        duration: s.
        substeps: integration steps.
        distance: largest accepted residual of the position, m.
        speed: the same of the velocity, m/s.
    """
    propagated = _coast(chief, 0.0, 0.0, 0.0, duration, substeps)
    position, velocity = 0.0, 0.0
    for c in range(3):
        position += (ephemeris[c] - propagated[c]) ** 2
        velocity += (ephemeris[3 + c] - propagated[3 + c]) ** 2
    return position <= distance * distance and velocity <= speed * speed  # false for NaN


@kernel(
    (WRITABLE_VECTOR, WRITABLE_MATRIX, WRITABLE_MATRIX, ANY_VECTOR, ANY_VECTOR, ANY_MATRIX, ANY_VECTOR, float64, int64)
)
def predict(
    state: Vector,
    covariance: Matrix,
    transition: Matrix,
    chief: Vector,
    next_chief: Vector,
    noise: Matrix,
    acceleration: Vector,
    duration: float,
    substeps: int,
) -> None:
    """Predict state and covariance of the extended Kalman filter.

    The deputy is propagated in the inertial frame beside the chief, so that neither a circular chief nor a small
    separation is assumed; the transition is the inertial one between the Hill frames at both ends, which the
    ephemeris gives. The relative position is taken from the chief as propagated: a force that the model lacks
    (Sun, Moon, drag) counts only by its difference between the two.

    Args:
        state: relative state, (6,), overwritten.
        covariance: of the state, (6, 6), overwritten.
        transition: transition matrix (6, 6), written.
        chief: inertial state at the start, (6,), m and m/s.
        next_chief: the same at the end.
        noise: process noise, (6, 6).
        acceleration: by thrust, along the Hill axes at the start, held in inertial space, (3,), m/s^2.
        duration: s.
        substeps: integration steps.
    """
    axes, rate = hill_frame(chief)
    thrust = _inertial(axes, acceleration)
    deputy, inertial = propagate_with_transition(to_inertial(axes, rate, chief, state), thrust, duration, substeps)
    next_axes, next_rate = hill_frame(next_chief)
    relative = product(product(hill_transform(next_axes, next_rate), inertial), hill_transform_inverse(axes, rate))
    transition[:] = relative
    covariance[:] = congruence(relative, covariance, noise)
    state[:] = to_relative(next_axes, next_rate, _coast(chief, 0.0, 0.0, 0.0, duration, substeps), deputy)


@kernel((ANY_VECTOR, ANY_VECTOR, ANY_MATRIX, ANY_VECTOR, float64, int64))
def propagate_points(
    chief: Vector, next_chief: Vector, points: Matrix, acceleration: Vector, duration: float, substeps: int
) -> Matrix:
    """Relative states (N, 6) after a duration, each as `predict` propagates its state."""
    axes, rate = hill_frame(chief)
    thrust = _inertial(axes, acceleration)
    next_axes, next_rate = hill_frame(next_chief)
    propagated = _coast(chief, 0.0, 0.0, 0.0, duration, substeps)
    out = np.empty((points.shape[0], 6))
    for index in range(points.shape[0]):
        start = to_inertial(axes, rate, chief, points[index])
        deputy = _coast(start, thrust[0], thrust[1], thrust[2], duration, substeps)
        out[index] = to_relative(next_axes, next_rate, propagated, deputy)
    return out


@kernel((ANY_VECTOR, ANY_VECTOR, ANY_VECTOR))
def change_chief(chief: Vector, state: Vector, other: Vector) -> Vector:
    """Relative state (6,) about another chief of a deputy with `state` about `chief`; both inertial, (6,)."""
    axes, rate = hill_frame(chief)
    other_axes, other_rate = hill_frame(other)
    return to_relative(other_axes, other_rate, other, to_inertial(axes, rate, chief, state))


@inline
def _propagate_direction(direction: Vector, transition: Matrix, mean_motion: float) -> None:
    """`propagate_direction` for use inside kernels."""
    moved = np.zeros(6)
    for i in range(6):
        for k in range(3):
            moved[i] += transition[i, k] * direction[k] + transition[i, 3 + k] * direction[3 + k] * mean_motion
    square = 0.0
    for i in range(3):
        moved[3 + i] /= mean_motion
        square += moved[i] * moved[i] + moved[3 + i] * moved[3 + i]
    for i in range(6):
        direction[i] = moved[i] / sqrt(square) if square > 0.0 else moved[i]


@kernel((WRITABLE_VECTOR, ANY_MATRIX, float64))
def propagate_direction(direction: Vector, transition: Matrix, mean_motion: float) -> None:
    """Multiply a direction (6,) by a transition matrix (6, 6), and normalise it.

    A direction is a relative state of unit length, its rates divided by the mean motion (rad/s).
    """
    _propagate_direction(direction, transition, mean_motion)


@kernel((WRITABLE_VECTOR, WRITABLE_MATRIX, ANY_MATRIX, float64))
def propagate_window(direction: Vector, total: Matrix, transition: Matrix, mean_motion: float) -> None:
    """`propagate_direction`, and multiply a transition matrix (6, 6) since earlier by the next one, in one call."""
    _propagate_direction(direction, transition, mean_motion)
    total[:] = product(transition, total)
