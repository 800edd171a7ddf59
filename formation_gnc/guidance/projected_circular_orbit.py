"""A circle as seen from the Earth."""

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class ProjectedCircularOrbit(Ring):
    """Along-track and cross-track the satellites go round a circle: y^2 + z^2 = size^2.

    Radially they swing by half of it: x = (size / 2) sin(phase) with y = size cos(phase), z = size
    sin(phase). Force-free under Hill's equations. Source: Kremmydas, listing cw_pco.
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief on its track."""
        towards_earth = -0.5 * size * mean_motion
        return hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, 2.0 * towards_earth, towards_earth]))
