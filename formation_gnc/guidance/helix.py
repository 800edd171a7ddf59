"""A circle as seen along the track."""

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class Helix(Ring):
    """Across the track the satellites go round a circle: x^2 + z^2 = (size / 2)^2.

    So they never come nearer to the chief's track than half their size, wherever they are along it: what an
    error along the track, the likeliest one, cannot undo. Force-free under Hill's equations. Source:
    Kremmydas, listing cw_helix.
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief, and beside its track."""
        return hill_from_lvlh(np.array([size, 0.5 * size, 0.0, 0.0, 0.0, -0.5 * size * mean_motion]))
