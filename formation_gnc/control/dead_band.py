"""Dead band: position errors that are tolerated without thrust."""

from collections.abc import Sequence
from math import hypot, pi


def is_tolerated(error: Sequence[float], band: Sequence[float], mean_motion: float, is_silent: bool) -> bool:
    """Whether an error asks for no thrust.

    A law that is silent stays so until the position is beyond the band. One that acts does until the error, in
    free motion by Hill's equations, stays within the band for a revolution: what is at rest in the middle of the
    band, but drifts, would be back at once.

    Args:
        error: (6,) state less target, Hill frame, m and m/s.
        band: (3,) tolerance per axis, m; none with a zero.
        mean_motion: of the chief, rad/s.
        is_silent: whether the law was silent before.
    """
    if not all(band):
        return False
    furthest = map(abs, error[:3]) if is_silent else _furthest(error, mean_motion)
    return all(each <= most for each, most in zip(furthest, band, strict=True))


def _furthest(error: Sequence[float], n: float) -> tuple[float, float, float]:
    """Upper bound (m) of each coordinate over a revolution of free motion: an ellipse, and the drift of its centre."""
    x, y, z, vx, vy, vz = error
    offset, amplitude = 4.0 * x + 2.0 * vy / n, hypot(3.0 * x + 2.0 * vy / n, vx / n)
    first = y - 2.0 * vx / n
    centre = max(abs(first), abs(first - 3.0 * pi * offset))
    return abs(offset) + amplitude, centre + 2.0 * amplitude, hypot(z, vz / n)
