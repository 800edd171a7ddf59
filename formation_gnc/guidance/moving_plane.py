"""A plane that moves across the track with every satellite in it."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.guidance.formation import FreeMotion, hill_from_lvlh
from formation_gnc.parameters import parameter
from formation_gnc.types import Vector


@dataclass(frozen=True)
class MovingPlaneParameters:
    """The innermost ellipse, and the motion of the plane."""

    size: float = parameter(
        400.0,
        unit="m",
        above=0.0,
        maximum=1e9,
        in_flight=True,
        doc="along-track half axis of the first ellipse",
    )
    height: float = parameter(
        800.0,
        unit="m",
        maximum=1e9,
        in_flight=True,
        doc="distance across the track when place 0 is furthest ahead",
    )
    slope: float = parameter(1.234567, in_flight=True, doc="rate across the track there, over that of place 0 outwards")


class MovingPlane(FreeMotion):
    """All satellites lie on one line in a plane parallel to the orbit's, which swings across the track.

    Places 0, 1, 2, 3 ... go round ellipses of 1, -1, 3, -3 ... times the first, (2 x)^2 + y^2 = size^2,
    opposite ones at opposite ends; z is the same for all: height cos(phase) + slope (size / 2) sin(phase).
    Force-free under Hill's equations. Source: Kremmydas, listing cw_moving_plane, with its init_y_amplitude
    as -height; the sign of z'_0 is that of its code, minus, not that of its heading (see `Equidistant`).
    """

    Parameters = MovingPlaneParameters

    @staticmethod
    def places(parameters: MovingPlaneParameters) -> None:
        """As many as one likes, each pair further out."""

    @staticmethod
    def start(parameters: MovingPlaneParameters, mean_motion: float, slot: int) -> Vector:
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
