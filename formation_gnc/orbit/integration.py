"""Kernels of a tick: fixed steps of order eight, divided where they do not resolve the motion, and impacts."""

from math import sqrt

import numpy as np
from numba import float64, int64
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from formation_gnc.orbit.environment import CONSTANTS, SURFACE, ephemerides_at, surroundings, unpack
from formation_gnc.orbit.forces.force import Floats
from formation_gnc.orbit.forces.model import CACHE_KEY, COEFFICIENTS, SETTINGS, acceleration
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel
from formation_gnc.orbit.runge_kutta import COUPLING, INSTANT_OF_STAGE, INSTANTS, STAGES, WEIGHTS
from formation_gnc.orbit.sky import EPHEMERIDES

Array = NDArray[np.float64]

UNRESOLVED_DISTANCE, UNRESOLVED_SPEED = 10.0, 0.1
"""Difference of a step from its last stage, m and m/s, beyond which it is divided. The stage is of lower order: in low
orbit it differs by 1e-5 m for 10 s and 1 m for 120 s, where the step itself errs by 1e-9 and 4e-5 m."""

_FINEST = 1 << 24
"""Most parts that a step is divided into."""

TICK = (
    float64[:, ::1],
    ANY_MATRIX,
    ANY_VECTOR,
    float64[:, ::1],
    float64[::1],
    int64,
    float64,
    float64,
    int64,
    float64[::1],
    float64[::1],
)
"""Signature of the kernels of a tick. They work in place: boxing a result array costs more than the rest of the
call."""


@inline
def over_mass(coefficients: Array, masses: Array, satellite: int, out: Array) -> None:
    """Fill in the coefficients of a satellite over its present mass; without bodies they stay zero."""
    if len(coefficients) > 0:
        for force in range(COEFFICIENTS):
            out[force] = coefficients[satellite, force] / masses[satellite]


@inline
def _comes_down(before: Array, after: Array, step: float, surface: float) -> bool:
    """Whether a satellite is not above the surface at the end of a step, or at a perigee within it.

    The surface is a sphere; the perigee is the least of the cubic through distances and radial rates at both ends.
    """
    square = after[0] * after[0] + after[1] * after[1] + after[2] * after[2]
    if not square >= surface * surface:  # NaN included
        return True
    start_rate = before[0] * before[3] + before[1] * before[4] + before[2] * before[5]
    end_rate = after[0] * after[3] + after[1] * after[4] + after[2] * after[5]
    if start_rate >= 0.0 or end_rate <= 0.0:
        return False
    start, end = sqrt(before[0] * before[0] + before[1] * before[1] + before[2] * before[2]), sqrt(square)
    start_rate, end_rate = start_rate / start * step, end_rate / end * step
    linear, quadratic = start_rate, 3.0 * (end - start) - 2.0 * start_rate - end_rate
    cubic = 2.0 * (start - end) + start_rate + end_rate
    root = sqrt(quadratic * quadratic - 3.0 * cubic * linear)  # a minimum lies within: real
    share = -linear / (quadratic + root)
    least: float = start + share * (linear + share * (quadratic + share * cubic))
    return least < surface


@inline
def _is_resolved(stage: Array, state: Array, share: float) -> bool:
    """Whether the last stage of a step agrees with its result within a share of the tolerance; false for NaN."""
    distance, speed = 0.0, 0.0
    for c in range(3):
        distance += (stage[c] - state[c]) ** 2
        speed += (stage[3 + c] - state[3 + c]) ** 2
    return distance <= (share * UNRESOLVED_DISTANCE) ** 2 and speed <= (share * UNRESOLVED_SPEED) ** 2


@inline
def _step(
    state: Array,
    thrust: Array,
    coefficients: Floats,
    settings: Floats,
    ephemerides: Array,
    constants: Floats,
    field: tuple[Array, Array],
    needed: int,
    air: Array,
    step: float,
    scratch: tuple[Array, Array, Array, Array],
) -> None:
    """Advance a state (6,) by a step.

    `field` are zonals and harmonics; `scratch` are `COUPLING`, `WEIGHTS`, rates (STAGES, 6) and stage (6,), which is
    left as the last stage.
    """
    zonals, harmonics = field
    coupling, weights, rates, stage = scratch
    for i in range(STAGES):
        for c in range(6):
            change = 0.0
            for j in range(i):
                change += coupling[i, j] * rates[j, c]
            stage[c] = state[c] + step * change
        now = to_fixed_tuple(stage, 6)
        around = surroundings(ephemerides[INSTANT_OF_STAGE[i]], constants, needed, now, air)
        ax, ay, az = acceleration(settings, coefficients, around, now, zonals, harmonics)
        rates[i, 0], rates[i, 1], rates[i, 2] = stage[3], stage[4], stage[5]
        rates[i, 3], rates[i, 4], rates[i, 5] = ax + thrust[0], ay + thrust[1], az + thrust[2]
    for c in range(6):
        change = 0.0
        for i in range(STAGES):
            change += weights[i] * rates[i, c]
        state[c] += step * change


_DIVIDED = (
    float64[::1],
    ANY_VECTOR,
    float64[::1],
    float64[::1],
    int64,
    float64,
    float64,
    float64[::1],
    float64[::1],
    int64,
)


@kernel(_DIVIDED, CACHE_KEY)
def _propagate_divided(
    state: Array,
    thrust: Array,
    coefficients: Array,
    settings: Array,
    needed: int,
    time: float,
    step: float,
    moment: Array,
    environment: Array,
    satellite: int,
) -> bool:
    """Propagate one satellite by a step in as many parts as resolve it, halved and doubled.

    Returns whether it comes down; `moment` (1,) is then the time from the start of the step, s.
    """
    coupling, weights = COUPLING.copy(), WEIGHTS.copy()
    settings_, coefficients_ = to_fixed_tuple(settings, SETTINGS), to_fixed_tuple(coefficients, COEFFICIENTS)
    ephemerides = np.zeros((len(INSTANTS), EPHEMERIDES))
    rates, stage, after = np.empty((STAGES, 6)), np.empty(6), np.empty(6)
    parts, surface = unpack(environment), environment[SURFACE]
    constants, air = to_fixed_tuple(parts.constants, CONSTANTS), parts.air[min(satellite, len(parts.air) - 1)]
    field, scratch = (parts.zonals, parts.harmonics), (coupling, weights, rates, stage)
    done, width = 0, _FINEST // 2
    while done < _FINEST:
        part, start = step * (width / _FINEST), time + step * (done / _FINEST)
        for instant in range(len(INSTANTS)):
            ephemerides_at(needed, start + INSTANTS[instant] * part, parts, ephemerides[instant])
        after[:] = state
        _step(after, thrust, coefficients_, settings_, ephemerides, constants, field, needed, air, part, scratch)
        if width > 1 and not _is_resolved(stage, after, 1e-3):  # what had to be divided is divided well
            width //= 2
            continue
        done += width
        comes_down = _comes_down(state, after, part, surface)
        state[:] = after
        if comes_down:
            moment[0] = step * (done / _FINEST)
            return True
        if _is_resolved(stage, after, 1e-5) and done % (2 * width) == 0 and 4 * width <= _FINEST:
            width *= 2
    return False


@kernel(TICK, CACHE_KEY)
def propagate_tick(
    states: Array,
    thrust: Array,
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
    """Propagate states by a tick.

    Returns:
        Index of the first satellite that comes down, with its state there and `moment` (1,) the time from the start
        of the tick, s; -1 while all are above the surface.
    """
    step = tick / substeps
    coupling, weights = COUPLING.copy(), WEIGHTS.copy()  # constants would be unrolled: seconds to compile
    satellites = states.shape[0]
    ephemerides = np.zeros((len(INSTANTS), EPHEMERIDES))
    per_mass = np.zeros(COEFFICIENTS)
    # Tuples stay in registers; with arrays a tick takes a third longer.
    settings_ = to_fixed_tuple(settings, SETTINGS)
    parts, surface = unpack(environment), environment[SURFACE]
    constants, field = to_fixed_tuple(parts.constants, CONSTANTS), (parts.zonals, parts.harmonics)
    rates = np.empty((STAGES, 6))
    stage, before = np.empty(6), np.empty(6)
    scratch = coupling, weights, rates, stage
    for substep in range(substeps):
        for instant in range(len(INSTANTS)):
            ephemerides_at(needed, time + (substep + INSTANTS[instant]) * step, parts, ephemerides[instant])
        for satellite in range(satellites):
            over_mass(coefficients, masses, satellite, per_mass)
            coefficients_ = to_fixed_tuple(per_mass, COEFFICIENTS)
            before[:] = states[satellite]
            now, push = states[satellite], thrust[satellite]
            air = parts.air[min(satellite, len(parts.air) - 1)]
            _step(now, push, coefficients_, settings_, ephemerides, constants, field, needed, air, step, scratch)
            moment[0] = step
            if _is_resolved(stage, now, 1.0):
                comes_down = _comes_down(before, now, step, surface)
            else:
                now[:] = before
                start = time + substep * step
                comes_down = _propagate_divided(
                    now, push, per_mass, settings, needed, start, step, moment, environment, satellite
                )
            if comes_down:
                moment[0] += substep * step
                return satellite
    return -1
