"""Helix."""

import numpy as np

from formation_gnc.guidance.formation import hill_from_lvlh
from formation_gnc.guidance.ring import Ring
from formation_gnc.types import Vector


class Helix(Ring):
    """Relative orbit that projects to a circle in the radial/cross-track plane: x^2 + z^2 = (size / 2)^2.

    The satellites keep half of `size` from the chief's track wherever they are along it. Along-track errors,
    which grow most, do not reduce that distance. Force-free under Hill's equations.

    Source: Kremmydas, listing cw_helix.
    """

    @staticmethod
    def first(size: float, mean_motion: float) -> Vector:
        """Ahead of the chief, and beside its track."""
        return hill_from_lvlh(np.array([size, 0.5 * size, 0.0, 0.0, 0.0, -0.5 * size * mean_motion]))
