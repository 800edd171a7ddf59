"""Passively safe relative orbits: relative eccentricity and inclination vectors, and the least manoeuvre to them.

About a near-circular chief free motion is, with u the angle since the start (Hill; D'Amico and Montenbruck 2006),

    x = a - e_c cos u + e_s sin u,  z = i_c cos u + i_s sin u,

and y drifts by -3/2 a u. Without drift (a = 0) the distance across the track never falls below

    r^2 = 1/2 (e^2 + i^2 - |(e_c + j e_s)^2 + (i_c - j i_s)^2|)

whatever y is: with parallel vectors, x largest where z is zero, it is the lesser of e and i.
"""

from collections.abc import Iterator
from functools import cache
from math import cos, hypot, pi, sin, sqrt, tau

import numpy as np
from scipy.optimize import linprog

from formation_gnc.relative.hill import HillModel
from formation_gnc.supervision.coasting import Burn
from formation_gnc.types import Matrix, Vector

ANGLES = 24
"""Directions of the vectors that are tried."""

SEGMENTS = 24
"""Segments of a manoeuvre in a revolution, over each of which the acceleration is held."""

NEAREST = 6
"""Orbits for which a manoeuvre is computed: those with the least estimated delta-v."""


def elements(relative: Vector, mean_motion: float) -> Vector:
    """(5,) a, e_c, e_s, i_c, i_s of a relative state (6,), m."""
    found: Vector = _from_state(mean_motion) @ relative
    return found


def _from_state(n: float) -> Matrix:
    return np.array(
        [
            [4.0, 0.0, 0.0, 0.0, 2.0 / n, 0.0],
            [3.0, 0.0, 0.0, 0.0, 2.0 / n, 0.0],
            [0.0, 0.0, 0.0, 1.0 / n, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / n],
        ]
    )


def least_separation(of: Vector) -> float:
    """Least distance across the track (m) of a relative orbit (5,) without drift, whatever its along-track distance."""
    _, ec, es, ic, si = of.tolist()
    e, i = hypot(ec, es), hypot(ic, si)
    square = 0.5 * (e * e + i * i - abs(complex(ec, es) ** 2 + complex(ic, -si) ** 2))
    return sqrt(max(0.0, square))


def safe_orbits(present: Vector, clearance: float, mean_motion: float) -> Iterator[Vector]:
    """Relative orbits (5,) without drift, with parallel vectors no shorter than a clearance (m), the nearest first.

    Each vector keeps what it has along the common direction where that is longer.
    """
    found: list[tuple[float, int, Vector]] = []
    for angle in (tau / ANGLES * np.arange(ANGLES)).tolist():
        c, s = cos(angle), sin(angle)
        for sign in (1.0, -1.0):
            e = max(clearance, present[1] * c + present[2] * s)
            i = max(clearance, sign * (present[4] * c + present[3] * s))
            orbit = np.array([0.0, e * c, e * s, sign * i * s, sign * i * c])
            change = orbit - present
            in_plane = max(hypot(change[1], change[2]), abs(change[0]))
            found.append((mean_motion * (0.5 * in_plane + hypot(change[3], change[4])), len(found), orbit))
    return (orbit for _, _, orbit in sorted(found)[:NEAREST])


def manoeuvre(change: Vector, limit: Vector, mean_motion: float, revolutions: int = 1) -> list[Burn] | None:
    """The burns of least delta-v, of all axes, that change the elements of a relative orbit by (5,), m.

    Args:
        change: of a, e_c, e_s, i_c, i_s.
        limit: largest acceleration (3,), m/s^2; 0 for an axis that does not work.
        mean_motion: of the chief, rad/s.
        revolutions: that the manoeuvre may take.

    Returns:
        The burns; None where the axes do not do it in that time.
    """
    axes = [axis for axis in range(3) if limit[axis] > 0.0]
    if not axes:
        return None
    effects = _effects(mean_motion, revolutions)[:, :, axes]  # (5, K, A)
    segments, step = effects.shape[1], tau / mean_motion / SEGMENTS
    matrix = effects.reshape(5, -1) * np.tile(limit[axes], segments)
    scale = max(float(np.abs(change).max()), 1e-6)
    answer = linprog(
        np.tile(limit[axes], 2 * segments),
        A_eq=np.hstack([matrix, -matrix]) / scale,
        b_eq=change / scale,
        bounds=(0.0, 1.0),
        method="highs",
    )
    if answer.status != 0:
        return None
    half = segments * len(axes)
    shares = (answer.x[:half] - answer.x[half:]).reshape(segments, len(axes))
    burns = []
    for place, row in enumerate(shares):
        acceleration = [0.0, 0.0, 0.0]
        for axis, share in zip(axes, row.tolist(), strict=True):
            acceleration[axis] = share * float(limit[axis]) if abs(share) > 1e-9 else 0.0
        if any(acceleration):
            x, y, z = acceleration
            burns.append(Burn(place * step, (place + 1) * step, (x, y, z)))
    return burns


@cache
def _effects(mean_motion: float, revolutions: int) -> Matrix:
    """(5, K, 3) change of the elements at the start by a unit acceleration in each segment."""
    model, step = HillModel(mean_motion), 2.0 * pi / mean_motion / SEGMENTS
    _, held = model.discretise(0.0, step)
    of_state, count = _from_state(mean_motion), SEGMENTS * revolutions
    back = [of_state @ model.transition(0.0, -(k + 1) * step) @ held for k in range(count)]
    return np.array(back).transpose(1, 0, 2)
