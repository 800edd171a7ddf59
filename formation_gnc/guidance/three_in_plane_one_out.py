"""Three in plane, one out."""

import math
from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Vector


@dataclass(frozen=True)
class ThreeInPlaneOneOutParameters:
    """The in-plane ellipse, and the cross-track oscillation."""

    size: float = parameter(
        1000.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="along-track semi-axis of the ellipse"
    )
    height: float = parameter(
        600.0, unit="m", above=0.0, maximum=1e9, in_flight=True, doc="cross-track amplitude of slot 3"
    )


class ThreeInPlaneOneOut(FreeMotion[ThreeInPlaneOneOutParameters]):
    """Slots 0 to 2 in the orbit plane, a third of a revolution apart on (2 x)^2 + y^2 = size^2; slot 3 out of plane.

    Slots 0 to 2 form a triangle of constant area, 3 sqrt(3) / 8 size^2, centred on the chief. Slot 3, with
    z^2 + (z' / n)^2 = height^2, passes through the chief's position twice a revolution, so the chief is no
    satellite here. Force-free under Hill's equations.

    Source: Kremmydas (4.1), (4.2) and listing cw_plane_1out, with the listing's minus sign of z'_0 and the
    text's y'_0 = 0 of slot 3. With the listing's y'_0 = 0.8 m/s the amplitude is sqrt(y_0^2 + (0.8 / n)^2),
    above 750 m for any y_0.
    """

    Parameters = ThreeInPlaneOneOutParameters

    @staticmethod
    def slot_count(parameters: ThreeInPlaneOneOutParameters) -> int:
        """Four."""
        return 4

    @classmethod
    def start(cls, parameters: ThreeInPlaneOneOutParameters, mean_motion: float, slot: int) -> Vector:
        """Slot 0 ahead of the chief, slot 3 at its cross-track amplitude."""
        if slot == 3:
            return hill_from_lvlh(np.array([0.0, parameters.height, 0.0, 0.0, 0.0, 0.0]))
        size = parameters.size
        first = hill_from_lvlh(np.array([size, 0.0, 0.0, 0.0, 0.0, -0.5 * size * mean_motion]))
        state: Vector = HillModel(mean_motion).transition(0.0, math.tau * slot / (3.0 * mean_motion)) @ first
        return state
