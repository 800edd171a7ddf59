"""Weights of a quadratic cost as parameters."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from formation_gnc.control.controller import Vehicle
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.types import Matrix, Vector

PROHIBITIVE = 1e12
"""Factor of the cost of thrust along an axis without thruster."""


def require_along_track(vehicle: Vehicle) -> None:
    """Raise DesignError without an along-track thruster: no other stops a drift along the track."""
    if not vehicle.thrust_limit[1] > 0.0:
        raise DesignError("thrust_limit along the track (y) is 0; it must be above 0 to control the drift")


def require_in_plane(law: str, vehicle: Vehicle) -> None:
    """Raise DesignError without a radial and an along-track thruster: three outputs take three inputs."""
    limits = vehicle.thrust_limit[:2].tolist()
    if not min(limits) > 0.0:
        raise DesignError(f"{law}: thrust_limit in the orbit plane (x, y) is {limits}; both must be above 0")


@dataclass(frozen=True)
class QuadraticWeights:
    """Weights by Bryson's rule, each the deviation with unit cost, or as matrices.

    Base of the parameters of every law with a quadratic cost.
    """

    position_error: tuple[float, ...] = parameter(
        (1.0, 1.0, 1.0),
        unit="m",
        length=3,
        above=0.0,
        in_flight=True,
        doc="position error with unit cost, per Hill axis",
    )
    velocity_error: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        unit="m/s",
        length=3,
        above=0.0,
        in_flight=True,
        doc="velocity error with unit cost, per Hill axis",
    )
    thrust: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        unit="N",
        length=3,
        above=0.0,
        in_flight=True,
        doc="force with unit cost, per Hill axis",
    )
    state_weight: tuple[float, ...] = parameter(
        (),
        in_flight=True,
        doc="state weight Q (6 x 6, row by row, SI) instead of position_error and velocity_error",
    )
    thrust_weight: tuple[float, ...] = parameter(
        (), unit="1/N^2", in_flight=True, doc="weight R on force (3 x 3, row by row) instead of thrust"
    )

    def state_matrix(self) -> Matrix:
        """Q (6, 6), SI units; raises DesignError for a wrong number of elements."""
        return _matrix("state_weight", self.state_weight, self.position_error + self.velocity_error)

    def thrust_matrix(self) -> Matrix:
        """R (3, 3) on force, 1/N^2; raises DesignError for a wrong number of elements."""
        return _matrix("thrust_weight", self.thrust_weight, self.thrust)

    def effort(self, vehicle: Vehicle) -> Matrix:
        """Weight (3, 3) on acceleration of a vehicle, prohibitive on an axis without thruster.

        Along-track thrust alone controls the in-plane motion, so that the radial axis is dispensable. The cross-track
        motion is coupled to nothing: without a thruster it is left to itself.

        Raises:
            DesignError: no along-track thruster, or a wrong number of elements.
        """
        require_along_track(vehicle)
        effort: Matrix = vehicle.mass**2 * self.thrust_matrix()
        if not vehicle.thrust_limit[0] > 0.0:
            effort[0, 1:] = effort[1:, 0] = 0.0
            effort[0, 0] *= PROHIBITIVE
        return effort

    def weights(self) -> dict[str, Any]:
        """These fields by name, for the parameters of another law with the same cost."""
        return {field.name: getattr(self, field.name) for field in fields(QuadraticWeights)}


def _matrix(name: str, values: tuple[float, ...], allowed: tuple[float, ...]) -> Matrix:
    """The given matrix, or that of Bryson's rule."""
    size = len(allowed)
    if not values:
        bryson: Vector = np.array(allowed) ** -2.0
        return np.diag(bryson)
    if len(values) != size**2:
        raise DesignError(f"{name} has {len(values)} values; it must have {size**2} ({size} rows of {size})")
    return np.array(values).reshape(size, size)
