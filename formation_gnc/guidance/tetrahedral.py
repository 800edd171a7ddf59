"""Tetrahedral formation."""

import math
from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class TetrahedralParameters:
    """Size of the tetrahedron."""

    size: float = parameter(
        1000.0,
        unit="m",
        above=0.0,
        maximum=1e9,
        in_flight=True,
        doc="half the distance between the two satellites at rest on the chief's track",
    )


class Tetrahedral(FreeMotion[TetrahedralParameters]):
    """Tetrahedron of constant volume: slots 2 and 3 at rest `size` behind and ahead of the chief, 0 and 1 around it.

    The volume is 2 sqrt(2) / (9 sqrt(3)) size A^2 with A = 3 sqrt(3) / 20 size, the scale of the motion of
    slots 0 and 1. Force-free under Hill's equations.

    Source: Kremmydas (4.4)-(4.6) and listing tetrahedral, with the y_0 of the listing: -sqrt(3) A for slot 0
    and A / sqrt(3) for slot 1. With the text's sqrt(3) A for both, the volume passes through zero. A is taken
    of half the distance between slots 2 and 3, as in the listing; the text takes it of the whole.
    """

    Parameters = TetrahedralParameters

    @staticmethod
    def slot_count(parameters: TetrahedralParameters) -> int:
        """Four."""
        return 4

    @classmethod
    def start(cls, parameters: TetrahedralParameters, mean_motion: float, slot: int) -> Vector:
        """The state of Kremmydas' satellite slot + 1, as in his listing."""
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
