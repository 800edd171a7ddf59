"""General circular orbit."""

import math

import numpy as np

from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class GeneralCircularOrbit(Ring):
    """Relative orbit at a constant distance from the chief: x^2 + y^2 + z^2 = size^2.

    A circle in the plane z = sqrt(3) x, one of the two planes in which Hill's equations have one; `Equidistant`
    has the other. Force-free under Hill's equations: x = (size / 2) sin(phase), y = size cos(phase).
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief on its track."""
        outwards = 0.5 * size * mean_motion
        return np.array([0.0, size, 0.0, outwards, 0.0, math.sqrt(3.0) * outwards])
