"""Transfers between relative orbits: shortest time, and delta-v.

Both are computed on Hill's equations for the error, the state less the target. As the target is in free motion,
so is the error, and the transfer takes it to zero.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.optimize import linprog

from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Matrix, Vector

SEGMENTS = 24
"""Segments of constant acceleration per revolution, and the least number per transfer."""

LONGEST = 100
"""Longest transfer, in revolutions; a target beyond it counts as unreachable."""

PRECISION = 0.01
"""Relative precision of the shortest time, which is found from above."""


def shortest_time(error: Vector, acceleration: Vector, mean_motion: float) -> float:
    """Shortest time (s) in which the thrusters take an error to zero; inf beyond `LONGEST` revolutions.

    The largest multiple of the error that they take to zero in a given time is the solution of a linear
    programme. As the error can stay at zero, the multiple does not decrease with time, and bisection finds the
    time at which it is one (Kremmydas 3.1.1).

    Args:
        error: (6,) state less target, Hill frame, m and m/s.
        acceleration: (3,) largest acceleration per Hill axis, m/s^2; zero for an axis without thrusters.
        mean_motion: of the chief, rad/s.
    """
    revolution = math.tau / mean_motion
    scale = np.repeat([1.0, mean_motion], 3)
    if np.abs(error / scale).max() < 1e-6:  # within a micrometre
        return 0.0

    def is_enough(duration: float) -> bool:
        return _reach(error, acceleration, mean_motion, duration) >= 1.0

    latest = 1e-2 * revolution
    while not is_enough(latest):
        latest *= 2.0
        if latest > LONGEST * revolution:
            return math.inf
    soonest = 0.0 if latest <= 1e-2 * revolution else 0.5 * latest
    while latest - soonest > PRECISION * latest:
        middle = 0.5 * (soonest + latest)
        soonest, latest = (soonest, middle) if is_enough(middle) else (middle, latest)
    return latest


def _reach(error: Vector, acceleration: Vector, mean_motion: float, duration: float) -> float:
    """Largest multiple (up to 2) of the error that the thrusters take to zero in a duration (s)."""
    model = HillModel(mean_motion)
    to_go, step = _segments(duration, mean_motion)
    effect = model.transition(0.0, to_go) @ model.discretise(0.0, step)[1] * acceleration  # (count, 6, 3)
    size = np.repeat([1.0, mean_motion], 3)
    size *= np.abs(error / size).max()
    # sum(effect u) + multiple * free = 0 with |u| <= 1, largest multiple
    free = model.transition(0.0, duration) @ error
    columns = np.column_stack([effect.transpose(1, 0, 2).reshape(6, -1), free]) / size[:, None]
    if not np.isfinite(columns).all():  # beyond the range of a double
        return 0.0
    cost = np.zeros(columns.shape[1])
    cost[-1] = -1.0
    bounds = [(-1.0, 1.0)] * (len(cost) - 1) + [(0.0, 2.0)]
    result = linprog(cost, A_eq=columns, b_eq=np.zeros(6), bounds=bounds, method="highs")
    return -float(result.fun) if result.status == 0 else 0.0


def _segments(duration: float, mean_motion: float) -> tuple[Vector, float]:
    """Times (s) from the end of each segment to the end of a transfer, and the length of a segment (s)."""
    count = max(SEGMENTS, math.ceil(SEGMENTS * duration * mean_motion / math.tau))
    step = duration / count
    return np.asarray(step * np.arange(count - 1, -1, -1)), step


def delta_v(errors: Matrix, duration: float, mean_motion: float) -> Vector:
    """Delta-v (...,) in m/s, summed over the Hill axes, of transfers that take errors (..., 6) to zero.

    That of the transfer with the least integral of the squared acceleration, u(t) = -B' Phi(T, t)' W^-1
    Phi(T, 0) e with the reachability Gramian W. It has a closed form, is smooth in the error, and close to
    that of a regulator with the same settling time. Thrust limits are neglected.

    Args:
        errors: (..., 6) states less targets, Hill frame, m and m/s.
        duration: of the transfers, s.
        mean_motion: of the chief, rad/s.
    """
    control, step = _least_effort(duration, mean_motion)
    accelerations = np.tensordot(errors, control, axes=(-1, -1))  # (..., count, 3)
    total: Vector = np.abs(accelerations).sum(axis=(-2, -1)) * step
    return total


@lru_cache(maxsize=4)
def _least_effort(duration: float, mean_motion: float) -> tuple[Matrix, float]:
    """Least-effort accelerations (segments, 3, 6) per unit error, and the length of a segment (s)."""
    model = HillModel(mean_motion)
    to_go, step = _segments(duration, mean_motion)
    effect = model.transition(0.0, to_go) @ model.discretise(0.0, step)[1]  # (count, 6, 3)
    gramian = np.einsum("nik,njk->ij", effect, effect)
    scale = np.repeat([1.0, mean_motion], 3)  # for a well-conditioned inverse
    inverse = np.linalg.inv(gramian / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.einsum("nik,ij->nkj", effect, inverse @ model.transition(0.0, duration)), step
