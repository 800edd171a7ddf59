"""Equidistant formation."""

import math

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class Equidistant(Ring):
    """Constant distances between the satellites, and to the chief.

    The slots form a regular polygon of radius `size`, which turns in the plane z = -sqrt(3) x: slots j apart
    are at the distance 2 size sin(pi j / satellites), so the distances are constant, but not equal. Force-free
    under Hill's equations.

    Source: Kremmydas (4.3), with the minus sign of z'_0 of his listing. With the plus sign of the text the
    orbit is centred on twice the start (docs/theory/errata.md).
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief on its track."""
        across, towards_earth = math.sqrt(0.75) * size * mean_motion, -0.5 * size * mean_motion
        return hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, across, towards_earth]))
