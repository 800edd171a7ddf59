"""Numerical propagation of inertial states, tick by tick, with thrust held over the tick.

Fixed steps of order eight: the same input gives the same bits, and ticks end exactly on a step. A step that does not
resolve the motion, such as a dive through dense air, is divided.
"""

from collections.abc import Callable, Sequence
from math import asin, atan2, degrees, inf, isfinite, pi, sqrt

import numpy as np
from numba import float64, int64
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import CACHE_KEY, COEFFICIENTS, SETTINGS, Forces, acceleration
from formation_gnc.orbit.forces.radiation import illumination
from formation_gnc.orbit.frames import inertial_acceleration
from formation_gnc.orbit.gravity import oblate_acceleration, oblate_gradient
from formation_gnc.orbit.integration import TICK, over_mass, propagate_tick
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, kernel
from formation_gnc.orbit.runge_kutta import COUPLING, STAGES, WEIGHTS
from formation_gnc.orbit.sky import EPHEMERIDES, earth_rotation_angle, look_up, sun

Array = NDArray[np.float64]


@kernel(TICK, CACHE_KEY)
def _propagate_with_thrust(
    states: Array,
    forces: Array,
    masses: Array,
    coefficients: Array,
    settings: Array,
    needed: int,
    time: float,
    tick: float,
    substeps: int,
    moment: Array,
) -> int:
    """`propagate_tick` under forces along the Hill axes of the first satellite."""
    thrust = inertial_acceleration(states[0], forces, masses)
    return propagate_tick(states, thrust, masses, coefficients, settings, needed, time, tick, substeps, moment)


@kernel(float64[:, ::1](ANY_MATRIX, ANY_VECTOR, float64[:, ::1], float64[::1], int64, float64), CACHE_KEY)
def _accelerations(
    states: Array, masses: Array, coefficients: Array, settings: Array, needed: int, time: float
) -> Array:
    """(N, 3) accelerations at states (N, 6)."""
    out = np.empty((len(states), 3))
    ephemerides = np.zeros(EPHEMERIDES)
    look_up(needed, time, ephemerides)
    per_mass, state = np.zeros(COEFFICIENTS), np.empty(6)
    for satellite in range(len(states)):
        over_mass(coefficients, masses, satellite, per_mass)
        state[:] = states[satellite]
        out[satellite, 0], out[satellite, 1], out[satellite, 2] = acceleration(
            to_fixed_tuple(settings, SETTINGS),
            to_fixed_tuple(per_mass, COEFFICIENTS),
            to_fixed_tuple(ephemerides, EPHEMERIDES),
            to_fixed_tuple(state, 6),
        )
    return out


@kernel(float64(float64, ANY_VECTOR))
def _illumination(time: float, position: Array) -> float:
    sx, sy, sz = sun(time)
    return illumination(sx, sy, sz, position[0], position[1], position[2])


class Propagator:
    """Numerical propagation of a set of satellites about the Earth, tick by tick."""

    def __init__(
        self,
        tick: float,
        substeps: int = 1,
        forces: Forces | None = None,
        bodies: Sequence[Body] = (),
        epoch: float = 0.0,
    ) -> None:
        """Prepare for ticks of one length.

        Args:
            tick: time between calls, s.
            substeps: integration steps in a tick; at least one.
            forces: force model; point mass and J2 by default.
            bodies: one for each satellite, in the order of the states; needed for drag and radiation pressure.
            epoch: time zero of the run, Terrestrial Time since J2000.0, s; it places Sun, Moon and Greenwich.

        Raises:
            ConfigurationError: a value that is not allowed, or no bodies for a force that acts on them.
        """
        if not 0.0 < tick < inf:
            raise ConfigurationError(f"tick is {tick} s: it must be finite and above zero")
        if substeps < 1:
            raise ConfigurationError(f"substeps is {substeps}: it must be at least 1")
        if not isfinite(epoch):
            raise ConfigurationError(f"epoch is {epoch} s: it must be finite")
        forces = forces or Forces()
        self._settings, self._needed = forces.settings(), forces.ephemerides()
        self._coefficients = forces.coefficients(bodies)
        self._tick, self._substeps, self._epoch = tick, substeps, epoch
        self._moment = np.zeros(1)
        self._masses = np.array([body.mass for body in bodies])

    def propagate(self, time: float, states: Array, accelerations: Array, masses: Array | None = None) -> Array:
        """States one tick later, with the given accelerations held, fixed in inertial space.

        Args:
            time: time since the epoch at the start of the tick, s.
            states: inertial states, (N, 6), m and m/s.
            accelerations: by thrust, inertial, (N, 3), m/s^2.
            masses: present masses, (N,), kg; those of the bodies by default.

        Returns:
            (N, 6); the arguments are left unchanged.

        Raises:
            ImpactError: a satellite has come down.
        """
        return self._after(propagate_tick, time, states, accelerations, self._masses if masses is None else masses)

    def propagate_with_thrust(self, time: float, states: Array, forces: Array, masses: Array) -> Array:
        """`propagate` with forces (N, 3), N, along the Hill axes of the first satellite at the start of the tick."""
        return self._after(_propagate_with_thrust, time, states, forces, masses)

    def acceleration(self, time: float, states: Array, masses: Array | None = None) -> Array:
        """Acceleration of each satellite by all forces in use, gravity included, without thrust.

        Args:
            time: time since the epoch, s.
            states: inertial states, (N, 6), m and m/s.
            masses: present masses, (N,), kg; those of the bodies by default.

        Returns:
            (N, 3), inertial, m/s^2.
        """
        self._check_count(states)
        present = self._masses if masses is None else masses
        result: Array = _accelerations(
            states, present, self._coefficients, self._settings, self._needed, self._epoch + time
        )
        return result

    def _check_count(self, states: Array) -> None:
        if len(self._coefficients) not in (0, len(states)):
            raise ConfigurationError(f"{len(self._coefficients)} bodies for {len(states)} satellites: each needs one")

    def _after(
        self,
        kernel_of_tick: Callable[..., int],
        time: float,
        states: Array,
        thrust: Array,
        masses: Array,
    ) -> Array:
        self._check_count(states)
        result, moment = states.copy(), self._moment
        fallen = kernel_of_tick(
            result,
            thrust,
            masses,
            self._coefficients,
            self._settings,
            self._needed,
            self._epoch + time,
            self._tick,
            self._substeps,
            moment,
        )
        if fallen >= 0:
            raise ImpactError(self._impact(fallen, time + float(moment[0]), result[fallen]))
        return result

    def _impact(self, satellite: int, time: float, state: Array) -> str:
        """Time and place at which a satellite has come down."""
        where = [float(value) for value in state]
        x, y, z = where[:3]
        radius = sqrt(x * x + y * y + z * z)
        if not radius > 0.0 or not isfinite(radius):
            return f"satellite {satellite} is below the Earth's surface at {time:g} s: state {where}"
        east = (atan2(y, x) - earth_rotation_angle(self._epoch + time) + pi) % (2.0 * pi) - pi
        return (
            f"satellite {satellite} is below the Earth's surface at {time:.10g} s, latitude "
            f"{degrees(asin(z / radius)):.1f} deg, longitude {degrees(east):.1f} deg: state {where}"
        )

    def illumination(self, time: float, position: Array) -> float:
        """Visible fraction of the Sun's disc: 0 in umbra, 1 in full sunlight.

        Args:
            time: time since the epoch, s.
            position: inertial, (3,), m, or the state it begins, (6,).
        """
        return _illumination(self._epoch + time, position)


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64))
def propagate_with_transition(state: Array, acceleration: Array, tick: float, substeps: int = 1) -> tuple[Array, Array]:
    """State and state transition matrix after a tick, under the point mass with J2.

    Args:
        state: inertial, (6,), m and m/s.
        acceleration: by thrust, inertial, (3,), m/s^2, held over the tick.
        tick: s.
        substeps: integration steps in the tick.

    Returns:
        The state, (6,), and its derivative with respect to the state at the start, (6, 6).
    """
    step = tick / substeps
    coupling, weights = COUPLING.copy(), WEIGHTS.copy()  # constants would be unrolled: seconds to compile
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
                        change += coupling[i, j] * rates[j, row, c]
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
                    change += weights[i] * rates[i, row, c]
                now[row, c] += step * change
    return now[0].copy(), now[1:].T.copy()
