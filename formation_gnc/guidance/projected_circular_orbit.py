"""Projected circular orbit."""

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class ProjectedCircularOrbit(Ring):
    """Relative orbit that projects to a circle in the along-track/cross-track plane: y^2 + z^2 = size^2.

    x = (size / 2) sin(phase), y = size cos(phase), z = size sin(phase). Force-free under Hill's equations.

    Source: Kremmydas, listing cw_pco.
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief on its track."""
        towards_earth = -0.5 * size * mean_motion
        return hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, 2.0 * towards_earth, towards_earth]))
