"""Moving plane."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class MovingPlaneParameters:
    """The innermost ellipse, and the cross-track motion of the plane."""

    size: float = parameter(
        400.0,
        unit="m",
        above=0.0,
        maximum=1e9,
        in_flight=True,
        doc="along-track semi-axis of the innermost ellipse",
    )
    height: float = parameter(
        800.0,
        unit="m",
        maximum=1e9,
        in_flight=True,
        doc="cross-track position when slot 0 is furthest ahead",
    )
    slope: float = parameter(
        1.234567, in_flight=True, doc="ratio of the cross-track rate to slot 0's radial rate when it is furthest ahead"
    )


class MovingPlane(FreeMotion[MovingPlaneParameters]):
    """All satellites on one line, in a plane parallel to the chief's orbit that oscillates across the track.

    Slots 0, 1, 2, 3, ... move on ellipses of 1, -1, 3, -3, ... times (2 x)^2 + y^2 = size^2, opposite ones at
    opposite ends, with a common z = height cos(phase) + slope (size / 2) sin(phase). Force-free under Hill's
    equations.

    Source: Kremmydas, listing cw_moving_plane, with its init_y_amplitude as -height. The sign of z'_0 is the
    minus of its code, not the plus of its heading (see `Equidistant`).
    """

    Parameters = MovingPlaneParameters

    @staticmethod
    def slot_count(parameters: MovingPlaneParameters) -> None:
        """Unlimited, each pair further out."""

    @classmethod
    def start(cls, parameters: MovingPlaneParameters, mean_motion: float, slot: int) -> Vector:
        """The state of Kremmydas' satellite slot + 1."""
        towards_earth = -0.5 * parameters.size * mean_motion
        k = slot + 1 if slot % 2 == 0 else -slot
        return hill_from_lvlh(
            np.array(
                [
                    k * parameters.size,
                    -parameters.height,
                    0.0,
                    0.0,
                    parameters.slope * towards_earth,
                    k * towards_earth,
                ]
            )
        )
