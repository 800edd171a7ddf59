"""Constant distances."""

import math

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class Equidistant(Ring):
    """The distances between the satellites, and to the chief, are constant in time.

    They are those of a regular polygon of radius `size`, 2 size sin(pi j / satellites) between places j
    apart: not equal to one another, despite the name. The polygon turns in the plane z = -sqrt(3) x.
    Force-free under Hill's equations. Source: Kremmydas (4.3), with the sign of z'_0 of his listing, minus:
    with the plus of the text the orbit is centred on twice the start (docs/theory/errata.md).
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief on its track."""
        across, towards_earth = math.sqrt(0.75) * size * mean_motion, -0.5 * size * mean_motion
        return hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, across, towards_earth]))
