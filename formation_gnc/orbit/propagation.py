"""Numerical propagation of inertial states, tick by tick, with thrust held over the tick.

Fixed steps of order eight: the same input gives the same bits, and the end of a tick is met exactly.
"""

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.gravity import ANY_VECTOR, oblate_acceleration, oblate_gradient
from formation_gnc.orbit.jit import kernel
from formation_gnc.orbit.runge_kutta import COUPLING, STAGES, WEIGHTS

Array = NDArray[np.float64]


@kernel(float64[:, ::1](float64[:, ::1], float64[:, ::1], float64, int64))
def _advance(states: Array, accelerations: Array, tick: float, substeps: int) -> Array:
    """States after a tick."""
    step = tick / substeps
    satellites = states.shape[0]
    now = states.copy()
    rates = np.empty((STAGES, 6))
    stage = np.empty(6)
    for satellite in range(satellites):
        for _ in range(substeps):
            for i in range(STAGES):
                for c in range(6):
                    change = 0.0
                    for j in range(i):
                        change += COUPLING[i, j] * rates[j, c]
                    stage[c] = now[satellite, c] + step * change
                ax, ay, az = oblate_acceleration(stage[0], stage[1], stage[2])
                rates[i, 0], rates[i, 1], rates[i, 2] = stage[3], stage[4], stage[5]
                rates[i, 3] = ax + accelerations[satellite, 0]
                rates[i, 4] = ay + accelerations[satellite, 1]
                rates[i, 5] = az + accelerations[satellite, 2]
            for c in range(6):
                change = 0.0
                for i in range(STAGES):
                    change += WEIGHTS[i] * rates[i, c]
                now[satellite, c] += step * change
    return now


class Propagator:
    """Truth of a set of satellites, each in its own orbit about the Earth."""

    def __init__(self, tick: float, substeps: int = 1) -> None:
        """Prepare for ticks of one length.

        Args:
            tick: time between calls, s.
            substeps: integration steps in a tick; at least one.

        Raises:
            ConfigurationError: for a tick or a number of substeps that is not above zero.
        """
        if not 0.0 < tick < float("inf"):
            raise ConfigurationError(f"tick is {tick} s: it must be finite and above zero")
        if substeps < 1:
            raise ConfigurationError(f"substeps is {substeps}: it must be at least 1")
        self.tick, self.substeps = tick, substeps

    def advance(self, time: float, states: Array, accelerations: Array) -> Array:
        """States one tick later, with the given accelerations held, fixed in inertial space.

        Args:
            time: time since the epoch at the start of the tick, s.
            states: inertial states, (N, 6), m and m/s.
            accelerations: by thrust, inertial, (N, 3), m/s^2.

        Returns:
            (N, 6); the arguments are left alone.
        """
        result: Array = _advance(states, accelerations, self.tick, self.substeps)
        return result


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64))
def advance_with_transition(
    state: Array, acceleration: Array, tick: float, substeps: int = 1
) -> tuple[Array, Array]:
    """State and state transition matrix after a tick, point mass with J2: what a filter predicts with.

    Args:
        state: inertial, (6,), m and m/s.
        acceleration: by thrust, inertial, (3,), m/s^2, held over the tick.
        tick: s.
        substeps: integration steps in the tick.

    Returns:
        The state, (6,), and its derivative with respect to the state at the start, (6, 6).
    """
    step = tick / substeps
    now = np.empty((7, 6))  # the state, then the columns of the transition matrix
    now[0] = state
    now[1:] = np.eye(6)
    rates = np.empty((STAGES, 7, 6))
    stage = np.empty((7, 6))
    for _ in range(substeps):
        for i in range(STAGES):
            for row in range(7):
                for c in range(6):
                    change = 0.0
                    for j in range(i):
                        change += COUPLING[i, j] * rates[j, row, c]
                    stage[row, c] = now[row, c] + step * change
            x, y, z = stage[0, 0], stage[0, 1], stage[0, 2]
            ax, ay, az = oblate_acceleration(x, y, z)
            xx, xy, xz, yy, yz, zz = oblate_gradient(x, y, z)
            rates[i, :, :3] = stage[:, 3:]
            rates[i, 0, 3] = ax + acceleration[0]
            rates[i, 0, 4] = ay + acceleration[1]
            rates[i, 0, 5] = az + acceleration[2]
            for row in range(1, 7):
                dx, dy, dz = stage[row, 0], stage[row, 1], stage[row, 2]
                rates[i, row, 3] = xx * dx + xy * dy + xz * dz
                rates[i, row, 4] = xy * dx + yy * dy + yz * dz
                rates[i, row, 5] = xz * dx + yz * dy + zz * dz
        for row in range(7):
            for c in range(6):
                change = 0.0
                for i in range(STAGES):
                    change += WEIGHTS[i] * rates[i, row, c]
                now[row, c] += step * change
    return now[0].copy(), now[1:].T.copy()
