"""Impulses that null relative elements about a near-circular chief, in closed form, and the least that any would take.

Elements are those of the deputy less those of its target, m, counted from the present place in the orbit; with the
mean motion n an impulse along the track at the angle t from now changes them by (2 / n) [1, -, cos t, sin t] in da, dex
and dey and by -3 (t_end - t) / n in the dlambda of a later time, one across by (1 / n) [cos t, sin t] in dix and diy.
"""

import math
from itertools import combinations

import numpy as np

from formation_gnc.types import Matrix, Vector


def in_plane_impulses(elements: Vector, mean_motion: float, horizon: float) -> Matrix:
    """Impulses along the track that null da, dlambda, dex and dey: two or three, of the least sum within the horizon.

    They are half a revolution apart, or a multiple of it, in line with the eccentricity vector; three of them have
    one solution, as the sums of the impulses, of their projections on the vector and of their moments are given (the
    middle one may be zero). All threes of the horizon are tried; the earliest of equals is taken.

    Args:
        elements: (6,) m.
        mean_motion: rad/s.
        horizon: rad, at least 3 pi.

    Returns:
        (N, 2) angle from now, rad, and delta-v, m/s, in order.
    """
    axis, along, ex, ey = elements[:4].tolist()
    first = _within_half_a_turn(math.atan2(ey, ex))
    angles = first + math.pi * np.arange(max(3, math.floor((horizon - first) / math.pi) + 1))
    signs = (-1.0) ** np.arange(len(angles))
    threes = np.array([each for each in combinations(range(len(angles)), 3) if abs(signs[list(each)].sum()) < 3.0])
    wanted = -mean_motion * np.array([axis / 2.0, (ex * math.cos(first) + ey * math.sin(first)) / 2.0, along / 3.0])
    moments = np.stack([np.ones(threes.shape), signs[threes], angles[threes]], axis=1)
    impulses = np.linalg.solve(moments, np.broadcast_to(wanted, (len(threes), 3))[..., None])[..., 0]
    sums = np.abs(impulses).sum(axis=1)
    best = int(np.argmax(sums <= sums.min() * (1.0 + 1e-9)))
    return np.column_stack([angles[threes[best]], impulses[best]])


def cross_track_impulse(elements: Vector, mean_motion: float) -> Matrix:
    """The impulse across the track that nulls dix and diy, at the next node of the two orbits: (1, 2) as above."""
    ix, iy = elements[4:].tolist()
    angle = _within_half_a_turn(math.atan2(iy, ix))
    return np.array([[angle, -mean_motion * (ix * math.cos(angle) + iy * math.sin(angle))]])


def least_in_plane(elements: Vector, mean_motion: float, horizon: float) -> float:
    """Lower bound (m/s) of the delta-v in the plane, of any number of impulses in any direction within a horizon, rad.

    The largest that da, the eccentricity vector or dlambda alone would take.
    """
    axis, along, ex, ey = elements[:4].tolist()
    return float(mean_motion * max(abs(axis) / 2.0, math.hypot(ex, ey) / 2.0, abs(along) / max(3.0 * horizon, 2.0)))


def least_across(elements: Vector, mean_motion: float) -> float:
    """Lower bound (m/s) of the delta-v across the track: n times the inclination vector."""
    return mean_motion * math.hypot(*elements[4:].tolist())


def _within_half_a_turn(angle: float) -> float:
    """The angle modulo pi, in [0, pi): the remainder of a tiny negative one is pi itself."""
    rest = angle % math.pi
    return rest if rest < math.pi else 0.0
