"""Three satellites round the chief in its orbit plane, and one that swings through it."""

import math
from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Vector


@dataclass(frozen=True)
class ThreeInPlaneOneOutParameters:
    """The ellipse and the swing."""

    size: float = parameter(
        1000.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="along-track half axis of the ellipse"
    )
    height: float = parameter(
        600.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="amplitude of the swing across the plane"
    )


class ThreeInPlaneOneOut(FreeMotion):
    """Places 0 to 2 are a third of a revolution apart on (2 x)^2 + y^2 = size^2, z = 0; place 3 swings.

    The three make a triangle of constant area, 3 sqrt(3) / 8 size^2, centred on the chief, which is a point
    here and no satellite: place 3, with z^2 + (z' / n)^2 = height^2, passes through it twice in a revolution.
    Force-free under Hill's equations. Source: Kremmydas (4.1), (4.2) and listing cw_plane_1out. Of the two,
    right are the listing's sign of z'_0, minus, and the text's y'_0 of place 3, zero: with the listing's 0.8
    m/s at the same y_0 the amplitude is sqrt(y_0^2 + (0.8 / n)^2), more than 750 m whatever y_0 is.
    """

    Parameters = ThreeInPlaneOneOutParameters

    @staticmethod
    def places(parameters: ThreeInPlaneOneOutParameters) -> int:
        """Four."""
        return 4

    @staticmethod
    def start(parameters: ThreeInPlaneOneOutParameters, mean_motion: float, slot: int) -> Vector:
        """Place 0 ahead of the chief, place 3 at the end of its swing."""
        if slot == 3:
            return hill_from_lvlh(np.array([0.0, parameters.height, 0.0, 0.0, 0.0, 0.0]))
        size = parameters.size
        first = hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, 0.0, -0.5 * size * mean_motion]))
        state: Vector = HillModel(mean_motion).transition(0.0, math.tau * slot / (3.0 * mean_motion)) @ first
        return state
