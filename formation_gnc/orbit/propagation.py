"""Numerical propagation of inertial states, tick by tick, with thrust held over the tick.

Fixed steps of order eight: the same input gives the same bits, and the end of a tick is met exactly.
"""

from collections.abc import Callable, Sequence
from math import inf, isfinite

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.forces import SKY, Body, Forces, acceleration, look_up
from formation_gnc.orbit.forces.radiation import illumination
from formation_gnc.orbit.frames import inertial_acceleration
from formation_gnc.orbit.gravity import oblate_acceleration, oblate_gradient
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, kernel
from formation_gnc.orbit.runge_kutta import COUPLING, INSTANT_OF_STAGE, INSTANTS, STAGES, WEIGHTS
from formation_gnc.orbit.sky import sun
from formation_gnc.parameters import leaves

Array = NDArray[np.float64]


class ImpactError(RuntimeError):
    """A satellite has come down: its state lies below the Earth's surface, or is not a number."""


_TICK = (float64[:, ::1], ANY_MATRIX, ANY_VECTOR, float64[:, ::1], int64[::1], float64, float64, int64)
"""What the kernels of a tick are given. They move the states on in place: to make Python an array of the
result costs more than all else of the call."""


@kernel(_TICK)
def _advance(
    states: Array,
    thrust: Array,
    masses: Array,
    areas: Array,
    on: NDArray[np.int64],
    time: float,
    tick: float,
    substeps: int,
) -> int:
    """Move states on by a tick; returns the first satellite that is no longer above the surface, or -1."""
    step = tick / substeps
    coupling, weights = COUPLING.copy(), WEIGHTS.copy()  # constants would be unrolled: seconds to compile
    satellites = states.shape[0]
    sky = np.zeros((len(INSTANTS), SKY))
    rates = np.empty((STAGES, 6))
    stage = np.empty(6)
    for substep in range(substeps):
        for instant in range(len(INSTANTS)):
            look_up(on, time + (substep + INSTANTS[instant]) * step, sky[instant])
        for satellite in range(satellites):
            drag_area, light_area = 0.0, 0.0
            if len(areas) > 0:
                drag_area = areas[satellite, 0] / masses[satellite]
                light_area = areas[satellite, 1] / masses[satellite]
            for i in range(STAGES):
                for c in range(6):
                    change = 0.0
                    for j in range(i):
                        change += coupling[i, j] * rates[j, c]
                    stage[c] = states[satellite, c] + step * change
                x, y, z, vx, vy, vz = stage
                ax, ay, az = acceleration(on, sky[INSTANT_OF_STAGE[i]], drag_area, light_area, x, y, z, vx, vy, vz)
                rates[i, 0], rates[i, 1], rates[i, 2] = vx, vy, vz
                rates[i, 3] = ax + thrust[satellite, 0]
                rates[i, 4] = ay + thrust[satellite, 1]
                rates[i, 5] = az + thrust[satellite, 2]
            for c in range(6):
                change = 0.0
                for i in range(STAGES):
                    change += weights[i] * rates[i, c]
                states[satellite, c] += step * change
    for satellite in range(satellites):
        x, y, z = states[satellite, 0], states[satellite, 1], states[satellite, 2]
        if not x * x + y * y + z * z >= EARTH_RADIUS * EARTH_RADIUS:
            return satellite
    return -1


@kernel(_TICK)
def _fly(
    states: Array,
    forces: Array,
    masses: Array,
    areas: Array,
    on: NDArray[np.int64],
    time: float,
    tick: float,
    substeps: int,
) -> int:
    """`_advance` under forces along the Hill axes of the first."""
    thrust = inertial_acceleration(states[0], forces, masses)
    return _advance(states, thrust, masses, areas, on, time, tick, substeps)


@kernel(float64(float64, ANY_VECTOR))
def _illumination(time: float, position: Array) -> float:
    sx, sy, sz = sun(time)
    return illumination(sx, sy, sz, position[0], position[1], position[2])


class Propagator:
    """Truth of a set of satellites, each in its own orbit about the Earth."""

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
            forces: which act; J2 alone by default.
            bodies: one for each satellite, as the states; needed for drag and radiation pressure.
            epoch: time zero of the run, Terrestrial Time since J2000.0, s; it places Sun, Moon and Greenwich.

        Raises:
            ConfigurationError: a value that is not allowed, or a body missing for a force that acts on it.
        """
        if not 0.0 < tick < inf:
            raise ConfigurationError(f"tick is {tick} s: it must be finite and above zero")
        if substeps < 1:
            raise ConfigurationError(f"substeps is {substeps}: it must be at least 1")
        if not isfinite(epoch):
            raise ConfigurationError(f"epoch is {epoch} s: it must be finite")
        forces = forces or Forces()
        if (forces.drag or forces.radiation_pressure) and not bodies:
            raise ConfigurationError("bodies is empty: drag and radiation pressure need one for each satellite")
        for body in bodies:
            for leaf in leaves(Body, {}):
                leaf.check(getattr(body, leaf.name))
        self._switches = forces.switches()
        self._tick, self._substeps, self._epoch = tick, substeps, epoch
        self._areas = np.array(
            [(body.area * body.drag_coefficient, body.area * body.reflectivity) for body in bodies]
        ).reshape(-1, 2)
        self._masses = np.array([body.mass for body in bodies])

    def advance(self, time: float, states: Array, accelerations: Array, masses: Array | None = None) -> Array:
        """States one tick later, with the given accelerations held, fixed in inertial space.

        Args:
            time: time since the epoch at the start of the tick, s.
            states: inertial states, (N, 6), m and m/s.
            accelerations: by thrust, inertial, (N, 3), m/s^2.
            masses: present masses, (N,), kg; those of the bodies by default.

        Returns:
            (N, 6); the arguments are left alone.

        Raises:
            ImpactError: a satellite has come down.
        """
        return self._after(_advance, time, states, accelerations, self._masses if masses is None else masses)

    def fly(self, time: float, states: Array, forces: Array, masses: Array) -> Array:
        """`advance` under forces along the Hill axes that the first satellite has at the start, (N, 3), N."""
        return self._after(_fly, time, states, forces, masses)

    def _after(
        self,
        move: Callable[..., int],
        time: float,
        states: Array,
        thrust: Array,
        masses: Array,
    ) -> Array:
        if len(self._areas) not in (0, len(states)):
            raise ConfigurationError(f"{len(self._areas)} bodies for {len(states)} satellites: each needs one")
        result = states.copy()
        fallen = move(
            result,
            thrust,
            masses,
            self._areas,
            self._switches,
            self._epoch + time,
            self._tick,
            self._substeps,
        )
        if fallen >= 0:
            where = [float(value) for value in result[fallen]]
            raise ImpactError(
                f"satellite {fallen} is below the Earth's surface at {time + self._tick:g} s: state {where}"
            )
        return result

    def illumination(self, time: float, position: Array) -> float:
        """Fraction of the Sun's disc that a satellite sees: 0 in umbra, 1 in full sunlight.

        Args:
            time: time since the epoch, s.
            position: inertial, (3,), m; a state will do.
        """
        return _illumination(self._epoch + time, position)


@kernel((ANY_VECTOR, ANY_VECTOR, float64, int64))
def advance_with_transition(state: Array, acceleration: Array, tick: float, substeps: int = 1) -> tuple[Array, Array]:
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
