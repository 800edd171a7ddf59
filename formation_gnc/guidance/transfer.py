"""What it takes to get from one relative orbit to another: the shortest time, and the delta-v.

Both on Hill's equations for the error, the state less the target: since the target moves freely, the error
does too, and a transfer is to take it to zero.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.optimize import linprog

from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Matrix, Vector

SEGMENTS = 24
"""Stretches of constant acceleration in a revolution, and at least in a transfer."""

LONGEST = 100
"""Revolutions after which a target counts as out of reach."""

PRECISION = 0.01
"""Share of the shortest time to which it is found, always from above."""


def shortest_time(error: Vector, acceleration: Vector, mean_motion: float) -> float:
    """Time (s) in which thrusters can take an error to zero at the soonest; inf beyond `LONGEST` revolutions.

    How large a multiple of the error the thrusters take to zero in a given time is a linear programme. Once
    at zero the error can stay there, so that the multiple grows with time, and bisection finds where it is
    one (Kremmydas 3.1.1).

    Args:
        error: (6,) state less target, Hill frame, m and m/s.
        acceleration: (3,) largest acceleration per Hill axis, m/s^2; an axis with zero does not push.
        mean_motion: rate of the chief, rad/s.
    """
    revolution = math.tau / mean_motion
    scale = np.repeat([1.0, mean_motion], 3)
    if np.abs(error / scale).max() < 1e-6:  # a micrometre: there
        return 0.0

    def enough(duration: float) -> bool:
        return _reach(error, acceleration, mean_motion, duration) >= 1.0

    latest = 1e-2 * revolution
    while not enough(latest):
        latest *= 2.0
        if latest > LONGEST * revolution:
            return math.inf
    soonest = 0.0 if latest <= 1e-2 * revolution else 0.5 * latest
    while latest - soonest > PRECISION * latest:
        middle = 0.5 * (soonest + latest)
        soonest, latest = (soonest, middle) if enough(middle) else (middle, latest)
    return latest


def _reach(error: Vector, acceleration: Vector, mean_motion: float, duration: float) -> float:
    """By how much the error may grow for the thrusters to just take it to zero in the time."""
    model = HillModel(mean_motion)
    to_go, step = _stretches(duration, mean_motion)
    effect = model.transition(0.0, to_go) @ model.discretise(0.0, step)[1] * acceleration  # (count, 6, 3)
    size = np.repeat([1.0, mean_motion], 3)
    size *= np.abs(error / size).max()
    # sum(effect u) + growth * free = 0 with |u| <= 1, greatest growth
    free = model.transition(0.0, duration) @ error
    columns = np.column_stack([effect.transpose(1, 0, 2).reshape(6, -1), free]) / size[:, None]
    cost = np.zeros(columns.shape[1])
    cost[-1] = -1.0
    bounds = [(-1.0, 1.0)] * (len(cost) - 1) + [(0.0, 2.0)]
    result = linprog(cost, A_eq=columns, b_eq=np.zeros(6), bounds=bounds, method="highs")
    return -float(result.fun) if result.status == 0 else 0.0


def _stretches(duration: float, mean_motion: float) -> tuple[Vector, float]:
    """Times (s) from the end of each stretch of constant thrust to the end of a transfer, and its length."""
    count = max(SEGMENTS, math.ceil(SEGMENTS * duration * mean_motion / math.tau))
    step = duration / count
    return np.asarray(step * np.arange(count - 1, -1, -1)), step


def delta_v(errors: Matrix, duration: float, mean_motion: float) -> Vector:
    """Delta-v (...,) in m/s, summed over the Hill axes, that takes errors (..., 6) to zero in a time, s.

    Of the transfer with the least integral of the squared acceleration, u(t) = -B' Phi(T, t)' W^-1 Phi(T, 0)
    e with the reachability Gramian W: in closed form, smooth in the error, and near what a regulator spends
    that takes as long. Thrust limits are left out.
    """
    control, step = _least_effort(duration, mean_motion)
    accelerations = np.tensordot(errors, control, axes=(-1, -1))  # (..., count, 3)
    total: Vector = np.abs(accelerations).sum(axis=(-2, -1)) * step
    return total


@lru_cache(maxsize=4)
def _least_effort(duration: float, mean_motion: float) -> tuple[Matrix, float]:
    """Accelerations (count, 3, 6) by which the least effort answers an error, each held for so long (s)."""
    model = HillModel(mean_motion)
    to_go, step = _stretches(duration, mean_motion)
    effect = model.transition(0.0, to_go) @ model.discretise(0.0, step)[1]  # (count, 6, 3)
    gramian = np.einsum("nik,njk->ij", effect, effect)
    scale = np.repeat([1.0, mean_motion], 3)  # positions and velocities alike, for a well-posed inverse
    inverse = np.linalg.inv(gramian / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.einsum("nik,ij->nkj", effect, inverse @ model.transition(0.0, duration)), step
