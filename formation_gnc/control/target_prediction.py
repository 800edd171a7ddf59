"""The target ahead of time: its state after a duration, and whether it has jumped."""

import numpy as np

from formation_gnc.records import Target
from formation_gnc.relative.model import RelativeModel, integrate
from formation_gnc.types import NANOSECONDS, Vector

JUMP_DISTANCE = 0.1
"""Least distance (m) from the smooth path that counts as a jump of the target."""

JUMP_RATIO = 0.01
"""The same relative to the distance moved since the previous target: curvature over a long tick."""

COARSENESS = 8
"""Integration step of the target's free motion over the model's own, which is exact to rounding error: a
relative error of 1e-8 at order eight."""


def has_jumped(previous: Target | None, target: Target) -> bool:
    """Whether a target is off the path that its velocity and that of the previous target span."""
    if previous is None:
        return False
    elapsed = (target.time - previous.time) / NANOSECONDS
    moved = target.relative_state[:3] - previous.relative_state[:3]
    smooth = 0.5 * elapsed * (previous.relative_state[3:] + target.relative_state[3:])
    off = float(np.linalg.norm(moved - smooth))
    return off > max(JUMP_DISTANCE, JUMP_RATIO * float(np.linalg.norm(moved)))


def target_after(target: Target, duration: float, model: RelativeModel) -> Vector:
    """(6,) target state after a duration (s): from the preview, and in free motion from its end.

    Between two preview states: the cubic Hermite interpolant of position. Time zero of the model is the
    target's stamp.
    """
    step, count = target.preview_step / NANOSECONDS, len(target.preview)
    knots = np.vstack([target.relative_state[None], target.preview.reshape(-1, 6)])
    index = min(int(duration / step), count) if count else 0
    rest = duration - index * step
    if index == count:
        begin = index * step if count else 0.0
        return integrate(
            lambda time, state: model.motion(time, state)[0],
            begin,
            knots[-1],
            rest,
            COARSENESS * model.longest_step,
        )
    return _hermite(knots[index], knots[index + 1], step, rest / step)


def _hermite(start: Vector, end: Vector, step: float, s: float) -> Vector:
    """(6,) state at the fraction `s` of a step (s) between two states."""
    slopes = step * start[3:], step * end[3:]
    across = start[:3] - end[:3]
    position = start[:3] + s * slopes[0] - s**2 * (3.0 * across + 2.0 * slopes[0] + slopes[1])
    position += s**3 * (2.0 * across + slopes[0] + slopes[1])
    rate = slopes[0] - 2.0 * s * (3.0 * across + 2.0 * slopes[0] + slopes[1])
    rate += 3.0 * s**2 * (2.0 * across + slopes[0] + slopes[1])
    return np.concatenate([position, rate / step])
