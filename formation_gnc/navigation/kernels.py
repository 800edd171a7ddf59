"""The filter's arithmetic, compiled: what it does at every tick costs less than calling NumPy for it.

The frames are those of `formation_gnc.orbit.frames`, the motion that of `formation_gnc.orbit.propagation`.
Plain loops, so that the bits do not depend on a linear-algebra library. What every tick calls changes the
arrays it is given: to make Python an array of a result costs more than all else of a call.
"""

from math import atan2, sqrt

import numpy as np
from numba import float64, int64
from numba.types import Array as NumbaArray
from numpy.typing import NDArray

from formation_gnc.orbit.frames import hill_frame, to_inertial, to_relative
from formation_gnc.orbit.gravity import oblate_acceleration
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.orbit.runge_kutta import COUPLING, STAGES, WEIGHTS
from formation_gnc.records import Sensor

Array = NDArray[np.float64]

_VECTOR, _MATRIX = float64[::1], float64[:, ::1]
"""Of arrays that are changed."""

_SENSORS = NumbaArray(int64, 1, "A", readonly=True)

_RADIUS, _RANGE_RATE, _LATITUDE = int(Sensor.RADIUS), int(Sensor.RANGE_RATE), int(Sensor.LATITUDE)
_RIGHT_ASCENSION, _CHIEF_RANGE = int(Sensor.RIGHT_ASCENSION), int(Sensor.CHIEF_RANGE)

_LEAST_PIVOT = 1e-13
"""Pivot of the Cholesky factorisation of a correlation matrix below which rounding may have eaten it."""


@inline
def _product(left: Array, right: Array) -> Array:
    rows, inner, columns = left.shape[0], right.shape[0], right.shape[1]
    out = np.zeros((rows, columns))
    for i in range(rows):
        for k in range(inner):
            factor = left[i, k]
            for j in range(columns):
                out[i, j] += factor * right[k, j]
    return out


@inline
def _congruence(matrix: Array, covariance: Array, added: Array) -> Array:
    """M P M' + Q, symmetric to the last bit."""
    half = _product(matrix, covariance)
    size = matrix.shape[0]
    out = np.empty((size, size))
    for i in range(size):
        for j in range(i + 1):
            total = added[i, j]
            for k in range(matrix.shape[1]):
                total += half[i, k] * matrix[j, k]
            out[i, j] = out[j, i] = total
    return out


@inline
def _transform(axes: Array, rate: float) -> Array:
    out = np.zeros((6, 6))
    for i in range(3):
        for c in range(3):
            out[i, c] = out[3 + i, 3 + c] = axes[i, c]
    for c in range(3):
        out[3, c] = rate * axes[1, c]
        out[4, c] = -rate * axes[0, c]
    return out


@inline
def _transform_inverse(axes: Array, rate: float) -> Array:
    out = np.zeros((6, 6))
    for i in range(3):
        for c in range(3):
            out[c, i] = out[3 + c, 3 + i] = axes[i, c]
    for c in range(3):
        out[3 + c, 0] = rate * axes[1, c]
        out[3 + c, 1] = -rate * axes[0, c]
    return out


@inline
def _coast(state: Array, ax: float, ay: float, az: float, tick: float, substeps: int) -> Array:
    """As `advance_with_transition`, without the transition."""
    step = tick / substeps
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


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64))
def coast(state: Array, acceleration: Array, duration: float, substeps: int) -> Array:
    """State (6,) after a duration (s, either sign) under point mass with J2 and a held inertial
    acceleration (3,)."""
    return _coast(state, acceleration[0], acceleration[1], acceleration[2], duration, substeps)


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64, float64, float64))
def can_be_there(chief: Array, told: Array, tick: float, substeps: int, distance: float, speed: float) -> bool:
    """Whether a tick later the chief can be where it is told to be.

    Args:
        chief: inertial state at the start of the tick, (6,), m and m/s.
        told: what the ephemeris gives for its end, (6,).
        tick: s.
        substeps: integration steps in the tick.
        distance: from where the model flies it, m, above which the ephemeris is not believed.
        speed: the same of the velocities, m/s.
    """
    flown = _coast(chief, 0.0, 0.0, 0.0, tick, substeps)
    apart, faster = 0.0, 0.0
    for c in range(3):
        apart += (told[c] - flown[c]) ** 2
        faster += (told[3 + c] - flown[3 + c]) ** 2
    return apart <= distance * distance and faster <= speed * speed  # false for what is not a number


@kernel((_VECTOR, _MATRIX, _MATRIX, ANY_VECTOR, ANY_VECTOR, ANY_MATRIX, ANY_VECTOR, float64, int64))
def fly(
    state: Array,
    covariance: Array,
    transition: Array,
    chief: Array,
    next_chief: Array,
    noise: Array,
    acceleration: Array,
    tick: float,
    substeps: int,
) -> None:
    """One prediction of the extended Kalman filter, exact in the motion.

    The deputy flies in the inertial frame beside the chief, so that neither a circular chief nor a small
    separation is assumed; the transition is that of the inertial flight, seen in the Hill frames at both
    ends, which the ephemeris gives. Their difference is taken between the two as the model flies them: a
    force that it leaves out (Sun, Moon, drag) then counts only as far as it differs between the two.

    Args:
        state: relative state, (6,), at the start, to become that at the end.
        covariance: of it, (6, 6), alike.
        transition: to become the transition matrix (6, 6).
        chief: inertial state at the start, (6,), m and m/s.
        next_chief: at the end.
        noise: what the process adds, (6, 6).
        acceleration: by thrust, along the Hill axes at the start, held in inertial space, (3,), m/s^2.
        tick: s.
        substeps: integration steps in the tick.
    """
    axes, rate = hill_frame(chief)
    thrust = np.empty(3)
    for c in range(3):
        thrust[c] = acceleration[0] * axes[0, c] + acceleration[1] * axes[1, c] + acceleration[2] * axes[2, c]
    deputy, flight = advance_with_transition(to_inertial(axes, rate, chief, state), thrust, tick, substeps)
    next_axes, next_rate = hill_frame(next_chief)
    flight = _product(_product(_transform(next_axes, next_rate), flight), _transform_inverse(axes, rate))
    transition[:] = flight
    covariance[:] = _congruence(flight, covariance, noise)
    state[:] = to_relative(next_axes, next_rate, _coast(chief, 0.0, 0.0, 0.0, tick, substeps), deputy)


@kernel((ANY_VECTOR, ANY_VECTOR, ANY_MATRIX, ANY_VECTOR, float64, int64))
def fly_points(
    chief: Array, next_chief: Array, points: Array, acceleration: Array, tick: float, substeps: int
) -> Array:
    """Relative states (N, 6) a tick later, as `fly` moves one."""
    axes, rate = hill_frame(chief)
    thrust = np.empty(3)
    for c in range(3):
        thrust[c] = acceleration[0] * axes[0, c] + acceleration[1] * axes[1, c] + acceleration[2] * axes[2, c]
    next_axes, next_rate = hill_frame(next_chief)
    flown = _coast(chief, 0.0, 0.0, 0.0, tick, substeps)
    out = np.empty((points.shape[0], 6))
    for index in range(points.shape[0]):
        deputy = _coast(to_inertial(axes, rate, chief, points[index]), thrust[0], thrust[1], thrust[2], tick, substeps)
        out[index] = to_relative(next_axes, next_rate, flown, deputy)
    return out


@kernel((ANY_MATRIX, ANY_MATRIX, ANY_MATRIX))
def spread(transition: Array, covariance: Array, noise: Array) -> Array:
    """F P F' + Q, symmetric to the last bit."""
    return _congruence(transition, covariance, noise)


@inline
def _read(sensors: NDArray[np.int64], deputy: Array, chief: Array) -> tuple[Array, Array]:
    x, y, z, vx, vy, vz = deputy[0], deputy[1], deputy[2], deputy[3], deputy[4], deputy[5]
    equatorial = x * x + y * y
    square = equatorial + z * z
    r, equatorial_root = sqrt(square), sqrt(equatorial)
    range_rate = (x * vx + y * vy + z * vz) / r
    readings = np.empty(len(sensors))
    jacobian = np.zeros((len(sensors), 6))
    for row in range(len(sensors)):
        sensor = sensors[row]
        if sensor == _RADIUS:
            readings[row] = r
            jacobian[row, 0], jacobian[row, 1], jacobian[row, 2] = x / r, y / r, z / r
        elif sensor == _RANGE_RATE:
            readings[row] = range_rate
            jacobian[row, 0] = (vx - range_rate * x / r) / r
            jacobian[row, 1] = (vy - range_rate * y / r) / r
            jacobian[row, 2] = (vz - range_rate * z / r) / r
            jacobian[row, 3], jacobian[row, 4], jacobian[row, 5] = x / r, y / r, z / r
        elif sensor == _LATITUDE:
            readings[row] = atan2(z, equatorial_root)
            jacobian[row, 0] = -z * x / (square * equatorial_root)
            jacobian[row, 1] = -z * y / (square * equatorial_root)
            jacobian[row, 2] = equatorial_root / square
        elif sensor == _RIGHT_ASCENSION:
            readings[row] = atan2(y, x)
            jacobian[row, 0], jacobian[row, 1] = -y / equatorial, x / equatorial
        elif sensor == _CHIEF_RANGE:
            dx, dy, dz = x - chief[0], y - chief[1], z - chief[2]
            distance = sqrt(dx * dx + dy * dy + dz * dz)
            readings[row] = distance
            jacobian[row, 0], jacobian[row, 1], jacobian[row, 2] = dx / distance, dy / distance, dz / distance
        else:
            readings[row] = np.nan
    return readings, jacobian


@kernel((_SENSORS, ANY_VECTOR, ANY_VECTOR))
def read(sensors: NDArray[np.int64], deputy: Array, chief: Array) -> tuple[Array, Array]:
    """Readings without noise and their Jacobian for a deputy with an inertial state.

    The full nonlinear radius, range rate and geocentric latitude (Neokleous 3.2, without the
    simplifications of his 3.13), right ascension, and distance to the chief.

    Args:
        sensors: the k sensors that read, constants of `formation_gnc.records.Sensor`.
        deputy: inertial state, (6,), m and m/s.
        chief: the same of the chief, which only its range depends on.

    Returns:
        (k,) readings in the unit of each sensor (not a number for an unknown one), and (k, 6) their
        derivatives with respect to the deputy's inertial state; neither is finite where the sensor has no
        direction: above a pole, or at the chief.
    """
    return _read(sensors, deputy, chief)


@kernel((_SENSORS, ANY_VECTOR, ANY_VECTOR))
def read_relative(sensors: NDArray[np.int64], chief: Array, state: Array) -> tuple[Array, Array]:
    """As `read`, from and with respect to the relative state (6,)."""
    axes, rate = hill_frame(chief)
    readings, jacobian = _read(sensors, to_inertial(axes, rate, chief, state), chief)
    return readings, _product(jacobian, _transform_inverse(axes, rate))


@kernel((ANY_VECTOR, ANY_VECTOR, ANY_VECTOR))
def relative_to(chief: Array, state: Array, other: Array) -> Array:
    """The relative state (6,) about another chief of a deputy with `state` about `chief`, both inertial
    (6,)."""
    axes, rate = hill_frame(chief)
    other_axes, other_rate = hill_frame(other)
    return to_relative(other_axes, other_rate, other, to_inertial(axes, rate, chief, state))


@kernel((_VECTOR, ANY_MATRIX, float64))
def carry(direction: Array, transition: Array, mean_motion: float) -> None:
    """Move a direction (6,), a relative state of unit length with its rates divided by the mean motion
    (rad/s), along with a transition (6, 6)."""
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


@kernel((_MATRIX, ANY_MATRIX))
def compose(since: Array, transition: Array) -> None:
    """Let a transition (6, 6) follow those `since` a time, (6, 6)."""
    since[:] = _product(transition, since)


@kernel((_MATRIX, ANY_MATRIX, ANY_MATRIX, ANY_VECTOR))
def inform(total: Array, jacobian: Array, since: Array, variance: Array) -> None:
    """Add (H Phi)' R^-1 (H Phi) to a Gramian (6, 6): H (k, 6), variances (k,)."""
    rows = _product(jacobian, since)
    for i in range(6):
        for j in range(i + 1):
            added = total[i, j]
            for row in range(rows.shape[0]):
                added += rows[row, i] * rows[row, j] / variance[row]
            total[i, j] = total[j, i] = added


@kernel((ANY_MATRIX, ANY_MATRIX, ANY_VECTOR))
def variances(jacobian: Array, covariance: Array, noise: Array) -> Array:
    """Variance (k,) of each of k readings: diagonal of H P H' with H (k, 6), plus their noise (k,)."""
    half = _product(jacobian, covariance)
    out = noise.copy()
    for row in range(jacobian.shape[0]):
        for k in range(jacobian.shape[1]):
            out[row] += half[row, k] * jacobian[row, k]
    return out


@kernel((ANY_VECTOR, ANY_MATRIX))
def sound(state: Array, covariance: Array) -> bool:
    """Whether a state (6,) and its covariance (6, 6) are finite."""
    total = 0.0
    for i in range(6):
        total += 0.0 * state[i]
        for j in range(6):
            total += 0.0 * covariance[i, j]
    return total == 0.0


@kernel((_MATRIX,))
def settle(covariance: Array) -> None:  # noqa: C901 - one Cholesky factorisation, in loops
    """Make a covariance symmetric, and positive definite if rounding has taken that from it; what is not a
    number stays so."""
    size = covariance.shape[0]
    for i in range(size):
        for j in range(i + 1):
            covariance[i, j] = covariance[j, i] = 0.5 * (covariance[i, j] + covariance[j, i])
    least = 1e-30
    for i in range(size):
        least = max(least, 1e-24 * covariance[i, i])
    scale = np.empty(size)
    for i in range(size):
        if covariance[i, i] < least:
            covariance[i, i] = least
        scale[i] = sqrt(covariance[i, i])
    factor = np.empty((size, size))
    added = 1e-12
    for _ in range(40):
        sound = True
        for j in range(size):
            for i in range(j, size):
                total = covariance[i, j] / (scale[i] * scale[j])
                for k in range(j):
                    total -= factor[i, k] * factor[j, k]
                if i == j:
                    sound = sound and total > _LEAST_PIVOT
                    factor[j, j] = sqrt(max(total, _LEAST_PIVOT))
                else:
                    factor[i, j] = total / factor[j, j]
        if sound:
            return
        for i in range(size):
            covariance[i, i] += added * scale[i] * scale[i]
        added *= 4.0
