"""A tetrahedron of constant volume."""

import math
from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class TetrahedralParameters:
    """How large the tetrahedron is."""

    size: float = parameter(
        1000.0,
        unit="m",
        above=0.0,
        maximum=1e9,
        in_flight=True,
        doc="half the distance of the two satellites that stay on the chief's track",
    )


class Tetrahedral(FreeMotion):
    """Places 2 and 3 stay `size` behind and ahead of the chief; 0 and 1 go round it at constant volume.

    The volume is 2 sqrt(2) / (9 sqrt(3)) size A^2 with A = 3 sqrt(3) / 20 size, the scale of the motion of 0
    and 1. Force-free under Hill's equations. Source: Kremmydas (4.4)-(4.6) and listing tetrahedral, of which
    the listing's y_0 are right: -sqrt(3) A for place 0 and A / sqrt(3) for place 1. With the text's sqrt(3) A
    for both the volume passes through zero. The text takes A of the whole length between the two on the
    track, the listing of its half, as here.
    """

    Parameters = TetrahedralParameters

    @staticmethod
    def places(parameters: TetrahedralParameters) -> int:
        """Four."""
        return 4

    @staticmethod
    def start(parameters: TetrahedralParameters, mean_motion: float, slot: int) -> Vector:
        """The states of Kremmydas' listing, his satellites 1 to 4."""
        size, n = parameters.size, mean_motion
        a = 3.0 * math.sqrt(3.0) / 20.0 * size
        down = 2.0 * math.sqrt(2.0) / 3.0 * a
        return hill_from_lvlh(
            np.array(
                [
                    [-2.0 / 3.0 * a, -math.sqrt(3.0) * a, down, 2.0 * n * down, 0.0, n * a / 3.0],
                    [2.0 * a, a / math.sqrt(3.0), 0.0, 0.0, 2.0 * math.sqrt(2.0 / 3.0) * n * a, -n * a],
                    [-size, 0.0, 0.0, 0.0, 0.0, 0.0],
                    [size, 0.0, 0.0, 0.0, 0.0, 0.0],
                ][slot]
            )
        )
