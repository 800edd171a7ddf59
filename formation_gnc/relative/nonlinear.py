"""The nonlinear equations of relative motion about an eccentric chief, and their Jacobian."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import Chief, ChiefState, KeplerChief, frame_matrix
from formation_gnc.relative.factorisation import FACTORISATIONS
from formation_gnc.relative.kernels import motion
from formation_gnc.relative.model import INPUT, NO_THRUST, ON_THE_CHIEF, Array, RelativeModel


class FactorisedModel(RelativeModel):
    """Nonlinear equations of motion with a state-dependent factorisation x' = A(x) x + B u about a chief."""

    is_linear = False

    chief: Chief

    @property
    def period(self) -> float:
        """Period of the chief's argument of latitude, s."""
        return self.chief.period

    @property
    def longest_step(self) -> float:
        """Longest integration step, s, set by the chief's motion at its perigee."""
        return self.chief.longest_step

    @abstractmethod
    def factorised(self, state: Array, chief: ChiefState, method: str = "sdc1") -> Array:
        """(..., 6, 6) matrix A(x) at states (..., 6), with one state of the chief or one each.

        Args:
            state: relative states, Hill frame, m and m/s.
            chief: the chief at the same instants.
            method: of `FACTORISATIONS`.
        """

    def derivative(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) right-hand side, by the factorisation SDC1, without cancellation."""
        free: Array = (self.factorised(state, self.chief.at(time)) @ np.asarray(state)[..., None])[..., 0]
        return free + np.asarray(acceleration) @ INPUT.T


@dataclass(frozen=True)
class NonlinearModel(FactorisedModel):
    """Exact relative motion of two satellites under point-mass gravity, at any separation and eccentricity.

    Assumes: spherical Earth, a chief that does not manoeuvre. Source: Joshi (3.22)-(3.26) and (6.27)-(6.40),
    with the corrections of docs/theory/errata.md.
    """

    chief: KeplerChief

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the chief's osculating ellipse."""
        return cls(KeplerChief.of(chief))

    def factorised(self, state: Array, chief: ChiefState, method: str = "sdc1") -> Array:
        """(..., 6, 6) matrix A(x) of point-mass gravity."""
        return FACTORISATIONS[method](state, chief)

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) Jacobian at the state: Joshi (6.27)-(6.40)."""
        return jacobian(state, self.chief.at(time))

    def motion(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> tuple[Array, Array]:
        """`derivative` (6,) and `dynamics` (6, 6) at one state, compiled."""
        return motion(state, acceleration, self.chief.at(time), oblate=False)

    def bounded(self, time: float, state: Array) -> Array:
        """(6,) state with the along-track rate for which deputy and chief have the same energy, and so period.

        Raises:
            OrbitError: the other rates alone exceed that energy.
        """
        chief = self.chief.at(time)
        x, y, z, vx, _, vz = (float(value) for value in state)
        radial_rate = -0.5 * chief.angular_acceleration * chief.radius / chief.angular_rate
        distance = math.sqrt((chief.radius + x) ** 2 + y**2 + z**2)
        square = chief.mu * (2.0 / distance - 1.0 / self.chief.semi_major_axis)
        square -= (radial_rate + vx - chief.angular_rate * y) ** 2 + vz**2
        if square < 0.0:
            raise OrbitError(
                f"relative state {[x, y, z, vx, vz]}: no along-track rate gives it the energy of the chief"
            )
        result = np.array(state, dtype=np.float64)
        result[4] = math.sqrt(square) - chief.angular_rate * (chief.radius + x)
        return result


def jacobian(state: Array, chief: ChiefState) -> Array:
    """(6, 6) Jacobian of the equations of motion under point-mass gravity, at a relative state (6,)."""
    place = np.array([chief.radius + state[0], state[1], state[2]])
    square = float(place @ place)
    matrix = frame_matrix(chief)
    matrix[3:, :3] += chief.mu / square**1.5 * (3.0 / square * np.outer(place, place) - np.eye(3))
    return matrix
