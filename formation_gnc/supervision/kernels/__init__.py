"""Compiled arithmetic of supervision: the forces of every tick, and dead reckoning at every comparison."""

from math import cos, inf, isfinite, sin, sqrt

import numpy as np
from numba import boolean, float64, int64
from numpy.typing import NDArray

from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.frames import hill_frame, to_inertial, to_relative
from formation_gnc.orbit.gravity import oblate_acceleration
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel

Array = NDArray[np.float64]

NOISE = 1.0
"""Largest error of an ephemeris that is well, m."""

GRAVITY, OTHER = 6e-4, 2e-5
"""Largest acceleration beyond point mass and J2, m/s^2: of gravity, mostly by J22, at the Earth's surface, falling with
the fourth power of the radius (EGM2008 has 3.1e-4 at 490 km); of Sun, Moon and drag."""

WINDOW = 300.0
"""Time over which an ephemeris is propagated before the propagation starts anew, s. Two windows overlap by half."""

LONGEST = 3000.0
"""Time after which it starts anew in any case, also while the ephemeris is off, s."""

STEP = 15.0
"""Longest integration step, s: in low orbit an error of a millimetre in fifty minutes."""

SUMS, BEFORE, SPEED, SHIFT, BURNED, KNOWN, TURN, TALLY = 0, 3, 6, 9, 12, 13, 14, 15
"""Places in the memory of `tally`: sums (3,) of differences over their limit; force (3,) commanded before, N; relative
velocity and position (3,) that the thrust since the last comparison will have caused at the next one, by Hill's
equations, m/s and m; propellant burned, kg; whether a command before is known; rate of the Hill frame, rad/s, not 0;
their number."""

LIMIT, ALLOWED, SCALE, TOTAL, ECLIPSE, SUSPECT, CEILING, PER_IMPULSE, RATE, TALLY_SETTINGS = 0, 3, *range(6, 14)
"""Places in the settings of `tally`: limit (3,), N; allowed difference (3,) over it, and over the command; limit of the
total, N; whether there is no thrust in eclipse; sum that is suspect, and the largest one; propellant by impulse,
kg/(N s); largest rate of it, kg/s; their number."""


@inline
def _hill_transition(rate: float, t: float) -> Array:
    """(6, 6) state transition matrix of Hill's equations."""
    c, s = cos(rate * t), sin(rate * t)
    out = np.zeros((6, 6))
    out[0, 0], out[0, 3], out[0, 4] = 4.0 - 3.0 * c, s / rate, 2.0 * (1.0 - c) / rate
    out[1, 0], out[1, 1], out[1, 3] = 6.0 * (s - rate * t), 1.0, -2.0 * (1.0 - c) / rate
    out[1, 4] = 4.0 * s / rate - 3.0 * t
    out[2, 2], out[2, 5] = c, s / rate
    out[3, 0], out[3, 3], out[3, 4] = 3.0 * rate * s, c, 2.0 * s
    out[4, 0], out[4, 3], out[4, 4] = -6.0 * rate * (1.0 - c), -2.0 * s, 4.0 * c - 3.0
    out[5, 2], out[5, 5] = -rate * s, c
    return out


@inline
def _reckon_impulse(x: float, y: float, z: float, half: float, after: float, memory: Array) -> None:
    """Add what an impulse (m/s) will have caused by Hill's equations.

    half: time (s) before it at which its axes were taken, half a tick, over which thrust is held.
    after: time from it to the next comparison, s.
    """
    rate = memory[TURN]
    c, s = cos(rate * half), sin(rate * half)
    impulse, phi = (c * x + s * y, c * y - s * x, z), _hill_transition(rate, after)
    for i in range(3):
        for axis in range(3):
            memory[SHIFT + i] += phi[i, 3 + axis] * impulse[axis]
            memory[SPEED + i] += phi[3 + i, 3 + axis] * impulse[axis]


@kernel(boolean(ANY_VECTOR, ANY_VECTOR, boolean, boolean, float64, float64, float64, float64[::1], float64[::1]))
def tally(
    applied: Array,
    commanded: Array,
    is_known: bool,
    in_eclipse: bool,
    mass: float,
    tick: float,
    after: float,
    memory: Array,
    settings: Array,
) -> bool:
    """Add the force of a tick that has ended; returns whether a sum of differences is suspect.

    Args:
        applied: force (3,) by telemetry, Hill frame at the start of the tick, held in inertial space over it, N.
        commanded: force (3,) for that tick.
        is_known: whether the command is.
        in_eclipse: whether the tick began in eclipse.
        mass: told, kg.
        tick: its length, s.
        after: time from its middle to the next comparison, s.
        memory: (`TALLY`,), changed.
        settings: (`TALLY_SETTINGS`,).
    """
    x, y, z = applied[0], applied[1], applied[2]
    is_finite = isfinite(x + y + z)
    if is_finite and (x != 0.0 or y != 0.0 or z != 0.0):
        total = sqrt(x * x + y * y + z * z) if settings[TOTAL] > 0.0 else abs(x) + abs(y) + abs(z)
        memory[BURNED] += min(total * settings[PER_IMPULSE], settings[RATE]) * tick
        if 0.0 < mass < inf:
            _reckon_impulse(tick / mass * x, tick / mass * y, tick / mass * z, 0.5 * tick, after, memory)
    if not (is_known and isfinite(commanded[0] + commanded[1] + commanded[2])):
        memory[KNOWN] = 0.0
        return False
    factor, largest = 1.0, 0.0
    if in_eclipse and settings[ECLIPSE] > 0.0:
        factor = 0.0
    elif settings[TOTAL] > 0.0:
        total = sqrt(commanded[0] ** 2 + commanded[1] ** 2 + commanded[2] ** 2)
        factor = settings[TOTAL] / total if total > settings[TOTAL] else 1.0
    for axis in range(3):
        largest = max(largest, factor * abs(commanded[axis]))
    is_suspect = False
    for axis in range(3):
        expected = factor * commanded[axis]
        before = memory[BEFORE + axis] if memory[KNOWN] > 0.0 else expected
        low, high = min(before, expected), max(before, expected)
        beyond = 1.0
        if isfinite(applied[axis]):
            beyond = max(low - applied[axis], applied[axis] - high, 0.0) - settings[SCALE] * largest
            beyond /= settings[LIMIT + axis]
        total = max(0.0, memory[SUMS + axis] + beyond - settings[ALLOWED + axis])
        memory[SUMS + axis] = min(total, settings[CEILING])
        is_suspect |= total >= settings[SUSPECT]
        memory[BEFORE + axis] = expected
    memory[KNOWN] = 1.0
    return is_suspect


@inline
def _advance(state: Array, duration: float, steps: int) -> None:
    """Propagate an inertial state (6,) under point mass and J2 (Runge-Kutta, order four)."""
    h = duration / steps
    rates, stage = np.empty((4, 6)), np.empty(6)
    for _ in range(steps):
        for i in range(4):
            share = 0.0 if i == 0 else (1.0 if i == 3 else 0.5)
            for c in range(6):
                stage[c] = state[c] + (share * h * rates[i - 1, c] if i > 0 else 0.0)
            rates[i, 0], rates[i, 1], rates[i, 2] = stage[3], stage[4], stage[5]
            rates[i, 3], rates[i, 4], rates[i, 5] = oblate_acceleration(stage[0], stage[1], stage[2])
        for c in range(6):
            state[c] += h / 6.0 * (rates[0, c] + 2.0 * rates[1, c] + 2.0 * rates[2, c] + rates[3, c])


def largest_unmodelled(radius: float) -> float:
    """Bound of the acceleration beyond point mass and J2 at a radius (m), m/s^2."""
    return GRAVITY * (EARTH_RADIUS / radius) ** 4 + OTHER


_bound = inline(largest_unmodelled)


@inline
def _unmodelled(state: Array) -> tuple[float, float]:
    """Radius (m) of an inertial state, and the largest acceleration beyond point mass and J2 there, m/s^2."""
    radius = sqrt(state[0] * state[0] + state[1] * state[1] + state[2] * state[2])
    return radius, _bound(radius)


@inline
def _congruence(transition: Array, covariance: Array) -> None:
    """Propagate a covariance (6, 6) in place."""
    product = np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            for k in range(6):
                product[i, j] += transition[i, k] * covariance[k, j]
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += product[i, k] * transition[j, k]
            covariance[i, j] = total


@inline
def _compare_chief(ephemeris: Array, anchors: Array, seconds: float, steps: int, out: Array) -> None:
    """Ratio and time of the ephemeris against the anchors, which move on."""
    _, unmodelled = _unmodelled(ephemeris)
    for k in range(len(anchors)):
        anchor = anchors[k, :6]
        _advance(anchor, seconds, steps)
        anchors[k, 6] += seconds
        square = 0.0
        for c in range(3):
            square += (ephemeris[c] - anchor[c]) ** 2
        ratio = sqrt(square) / (NOISE + 0.5 * unmodelled * anchors[k, 6] ** 2)
        if not ratio < inf:
            ratio = inf
        out[0], out[1] = max(out[0], ratio), max(out[1], anchors[k, 6])
        if anchors[k, 6] >= (WINDOW if ratio < 1.0 else LONGEST) or ratio == inf:
            anchors[k, :6], anchors[k, 6] = ephemeris, 0.0


@inline
def _compare_track(
    track: Array, covariance: Array, relative: Array, thrust: Array, seconds: float, steps: int, out: Array
) -> None:
    """Difference of a relative state from a track, which moves on, in standard deviations of the latter."""
    chief, deputy = track[:6], track[6:12]
    _, rate = hill_frame(chief)
    _advance(chief, seconds, steps)
    _advance(deputy, seconds, steps)
    track[12] += seconds
    phi = _hill_transition(rate, seconds)
    _congruence(phi, covariance)
    axes, rate = hill_frame(chief)
    reckoned = to_relative(axes, rate, chief, deputy)
    for i in range(6):
        reckoned[i] += thrust[i]
    deputy[:] = to_inertial(axes, rate, chief, reckoned)
    radius, unmodelled = _unmodelled(chief)
    distance = sqrt(reckoned[0] ** 2 + reckoned[1] ** 2 + reckoned[2] ** 2)
    differential = 4.0 * unmodelled * distance / radius
    for i in range(6):
        allowed = differential * track[12] * (0.5 * track[12] if i < 3 else 1.0)
        variance = covariance[i, i]
        sigma = sqrt(variance) if variance >= 0.0 else np.nan
        out[i] = max(0.0, abs(relative[i] - reckoned[i]) - allowed) / sigma
        if not out[i] < inf:
            out[i] = inf


@inline
def _restart(track: Array, covariance: Array, chief: Array, relative: Array, now: Array) -> None:
    axes, rate = hill_frame(chief)
    track[:6], track[6:12], track[12] = chief, to_inertial(axes, rate, chief, relative), 0.0
    covariance[:] = now


@kernel(
    int64(
        ANY_VECTOR,
        ANY_VECTOR,
        ANY_VECTOR,
        ANY_MATRIX,
        int64,
        float64,
        float64[:, ::1],
        float64[:, ::1],
        float64[:, :, ::1],
        float64[::1],
        float64[::1],
        float64[::1],
    )
)
def reckon(
    ephemeris: Array,
    chief: Array,
    relative: Array,
    covariance: Array,
    estimates: int,
    seconds: float,
    anchors: Array,
    tracks: Array,
    covariances: Array,
    lengths: Array,
    memory: Array,
    out: Array,
) -> int:
    """Propagate ephemeris and estimates from the last comparison to this one, compare, and begin the next interval.

    Args:
        ephemeris: inertial state (6,) of the chief, m and m/s.
        chief: the same (6,) in the estimate.
        relative: estimated relative state, (6,).
        covariance: of the latter, (6, 6).
        estimates: 0 for no estimate, 1 for the first one of a filter, 2 for one that goes on.
        seconds: since the last comparison.
        anchors: (2, 7) propagated ephemerides with their times, s; changed. Not finite to begin with.
        tracks: (N, 13) propagated estimates: chief and deputy, inertial, and time, s; changed. Time below 0 for none.
        covariances: (N, 6, 6) of these; changed.
        lengths: (N,) time after which each starts anew, s.
        memory: of `tally`: what the thrust since the last comparison has caused, which is cleared, and the rate of the
            Hill frame, which is set.
        out: (2 + 6 N,) ratio and time of the ephemeris, and differences of the relative state from each track, in
            standard deviations.

    Returns:
        Which of `out` is there: bit 0 for the ephemeris, bit 1 + n for track n.
    """
    steps = int(np.ceil(seconds / STEP))
    thrust = np.empty(6)
    for i in range(3):
        thrust[i], thrust[3 + i] = memory[SHIFT + i], memory[SPEED + i]
        memory[SHIFT + i] = memory[SPEED + i] = 0.0
    _, rate = hill_frame(ephemeris)
    if isfinite(rate) and rate > 0.0:
        memory[TURN] = rate
    given = 0
    if anchors[0, 6] >= 0.0:
        out[0] = out[1] = 0.0
        _compare_chief(ephemeris, anchors, seconds, steps, out)
        given = 1
    else:
        for k in range(len(anchors)):
            anchors[k, :6], anchors[k, 6] = ephemeris, 0.5 * WINDOW * k
    for n in range(len(tracks)):
        if estimates == 2 and tracks[n, 12] >= 0.0:
            _compare_track(tracks[n], covariances[n], relative, thrust, seconds, steps, out[2 + 6 * n : 8 + 6 * n])
            given |= 2 << n
        if estimates == 0:
            tracks[n, 12] = -1.0
        elif estimates == 1 or not 0.0 <= tracks[n, 12] < lengths[n]:
            _restart(tracks[n], covariances[n], chief, relative, covariance)
    return given
