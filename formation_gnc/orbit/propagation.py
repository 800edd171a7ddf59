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
from formation_gnc.orbit.atmosphere import columns
from formation_gnc.orbit.environment import CONSTANTS, Environment, ephemerides_at, surroundings, unpack
from formation_gnc.orbit.ephemerides import Ephemerides
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import CACHE_KEY, COEFFICIENTS, SETTINGS, Forces, acceleration
from formation_gnc.orbit.forces.radiation import illumination
from formation_gnc.orbit.frames import inertial_acceleration
from formation_gnc.orbit.gravity import oblate_acceleration, oblate_gradient
from formation_gnc.orbit.integration import TICK, over_mass, propagate_tick
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, kernel
from formation_gnc.orbit.runge_kutta import COUPLING, STAGES, WEIGHTS
from formation_gnc.orbit.sky import EPHEMERIDES, SUN

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
    environment: Array,
) -> int:
    """`propagate_tick` under forces along the Hill axes of the first satellite."""
    thrust = inertial_acceleration(states[0], forces, masses)
    return propagate_tick(
        states, thrust, masses, coefficients, settings, needed, time, tick, substeps, moment, environment
    )


_FORCES = (float64[:, ::1], float64[::1], int64, float64, float64[::1])


@kernel(float64[:, ::1](ANY_MATRIX, ANY_VECTOR, *_FORCES), CACHE_KEY)
def _accelerations(
    states: Array, masses: Array, coefficients: Array, settings: Array, needed: int, time: float, environment: Array
) -> Array:
    """(N, 3) accelerations at states (N, 6)."""
    out = np.empty((len(states), 3))
    ephemerides = np.zeros(EPHEMERIDES)
    parts = unpack(environment)
    ephemerides_at(needed, time, parts, ephemerides)
    per_mass, state, constants = np.zeros(COEFFICIENTS), np.empty(6), to_fixed_tuple(parts.constants, CONSTANTS)
    for satellite in range(len(states)):
        over_mass(coefficients, masses, satellite, per_mass)
        state[:] = states[satellite]
        now, air = to_fixed_tuple(state, 6), parts.air[min(satellite, len(parts.air) - 1)]
        around = surroundings(ephemerides, constants, needed, now, air)
        out[satellite, 0], out[satellite, 1], out[satellite, 2] = acceleration(
            to_fixed_tuple(settings, SETTINGS),
            to_fixed_tuple(per_mass, COEFFICIENTS),
            around,
            now,
            parts.zonals,
            parts.harmonics,
        )
    return out


@kernel(float64(float64, ANY_VECTOR, float64[::1]))
def _illumination(time: float, position: Array, environment: Array) -> float:
    ephemerides, parts = np.zeros(EPHEMERIDES), unpack(environment)
    ephemerides_at(SUN, time, parts, ephemerides)
    place = to_fixed_tuple(position, 3)
    around = surroundings(ephemerides, to_fixed_tuple(parts.constants, CONSTANTS), SUN, place, parts.air[0])
    return illumination(
        around.sun_x,
        around.sun_y,
        around.sun_z,
        place[0],
        place[1],
        place[2],
        around.radius,
        around.sun_radius,
    )


class Propagator:
    """Numerical propagation of a set of satellites about the Earth, tick by tick."""

    def __init__(
        self,
        tick: float,
        substeps: int = 1,
        forces: Forces | None = None,
        bodies: Sequence[Body] = (),
        epoch: float = 0.0,
        environment: Environment | None = None,
    ) -> None:
        """Prepare for ticks of one length.

        Args:
            tick: time between calls, s.
            substeps: integration steps in a tick; at least one.
            forces: force model; point mass and J2 by default.
            bodies: one for each satellite, in the order of the states; needed for drag and radiation pressure.
            epoch: time zero of the run, Terrestrial Time since J2000.0, s; it places Sun, Moon and Greenwich.
            environment: Earth, Sun, Moon and air; `forces.environment()` by default.

        Raises:
            ConfigurationError: a value that is not allowed, no bodies for a force that acts on them, an epoch that
                the ephemerides do not cover, or a package that they or the density model need is missing.
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
        self._environment = environment or forces.environment()
        self._ephemerides = Ephemerides(self._environment.sun, self._environment.moon)
        self._has_density_model = callable(self._environment.density)
        self._is_constant = not self._has_density_model and self._ephemerides.is_series
        """Whether the packed environment is the same at all times."""
        self._table = self._ephemerides.table(epoch, epoch + tick)  # raises for an epoch that is not covered
        self._packed = self._environment.packed(*self._table)

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
        if self._has_density_model:
            return self.propagate(time, states, inertial_acceleration(states[0], forces, masses), masses)
        return self._after(_propagate_with_thrust, time, states, forces, masses)

    def acceleration(self, time: float, states: Array, masses: Array | None = None) -> Array:
        """Acceleration of each satellite by all forces in use, gravity included, without thrust.

        Args:
            time: time since the epoch, s.
            states: inertial states, (N, 6), or one alone, (6,), m and m/s.
            masses: present masses, (N,) or one number, kg; those of the bodies by default.

        Returns:
            (N, 3), or (3,) for one state, inertial, m/s^2.
        """
        rows = np.atleast_2d(np.asarray(states, dtype=np.float64))
        self._check_count(rows)
        present = self._masses if masses is None else np.atleast_1d(np.asarray(masses, dtype=np.float64))
        moment = self._epoch + time
        environment = self._packed_at(moment, 0.0, rows)
        result: Array = _accelerations(
            rows, present, self._coefficients, self._settings, self._needed, moment, environment
        )
        return result if np.ndim(states) == 2 else result[0]

    def _check_count(self, states: Array) -> None:
        if len(self._coefficients) not in (0, len(states)):
            raise ConfigurationError(f"{len(self._coefficients)} bodies for {len(states)} satellites: each needs one")

    def _packed_at(self, begin: float, step: float, states: Array | None = None) -> Array:
        """Packed environment over a step from a time, s since J2000.0, with the air about satellites that coast."""
        if self._is_constant:
            return self._packed
        table = self._ephemerides.table(begin, begin + step)
        if table is not self._table:
            self._table, self._packed = table, self._environment.packed(*table)
        density, earth = self._environment.density, self._environment.earth
        if states is None or not callable(density):
            return self._packed
        ellipsoid = earth.mu, earth.radius, earth.flattening
        air = columns(density, begin, states, step, earth.rotation_angle, ellipsoid)
        return self._environment.packed(*table, air)

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
        # A model of the density is sampled for every step.
        parts = self._substeps if self._has_density_model else 1
        step, substeps = self._tick / parts, self._substeps // parts
        for part in range(parts):
            begin = self._epoch + time + part * step
            fallen = kernel_of_tick(
                result,
                thrust,
                masses,
                self._coefficients,
                self._settings,
                self._needed,
                begin,
                step,
                substeps,
                moment,
                self._packed_at(begin, step, result),
            )
            if fallen >= 0:
                raise ImpactError(self._impact(fallen, time + part * step + float(moment[0]), result[fallen]))
        return result

    def _impact(self, satellite: int, time: float, state: Array) -> str:
        """Time and place at which a satellite has come down."""
        where = [float(value) for value in state]
        x, y, z = where[:3]
        radius = sqrt(x * x + y * y + z * z)
        if not radius > 0.0 or not isfinite(radius):
            return f"satellite {satellite} is below the Earth's surface at {time:g} s: state {where}"
        east = (atan2(y, x) - self._environment.earth.rotation_angle(self._epoch + time) + pi) % (2.0 * pi) - pi
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
        moment = self._epoch + time
        return _illumination(moment, position, self._packed_at(moment, 0.0))


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
