"""Gim and Alfriend's state transition matrix for J2 and an eccentric chief, by differences of elements."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np

from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.frames import hill_transform, hill_transform_inverse
from formation_gnc.orbit.mean import mean_state, osculating_state
from formation_gnc.relative.chief import OblateChief
from formation_gnc.relative.element_differences import (
    check_node,
    secular_slopes,
    secular_transition,
    sigma,
    true_from_mean_latitude,
)
from formation_gnc.relative.model import ON_THE_CHIEF, Array, LinearModel
from formation_gnc.relative.oblate import OblateModel

DIFFERENCE = 1e-4
"""Relative step of the central differences of the short-period perturbations, for a relative error of 1e-10."""


@dataclass(frozen=True)
class GimAlfriendModel(LinearModel):
    """Linear relative motion under J2 about a chief of any eccentricity.

    The state is Sigma times differences of osculating elements (Joshi (3.49)-(3.51)), which are D times those of
    mean elements, which in turn change at constant rates under J2: Phi = Sigma D M D^-1 Sigma^-1. Long-period
    perturbations, singular at the critical inclination, stay in the mean elements. The chief's own osculating
    elements are integrated instead of taken from the theory: docs/theory/relative-motion.md.

    Assumes: separation much smaller than the radius; no equatorial chief. The error is of order J2^2.

    Raises:
        OrbitError: an inclination within a milliradian of 0 or pi.
    """

    has_j2 = True

    elements: Elements
    """Osculating elements of the chief at time zero."""

    def __post_init__(self) -> None:
        """Reject a chief without a node."""
        check_node(self.elements, "differences of elements")

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the chief's orbit under J2."""
        return cls(chief)

    @property
    def chief(self) -> OblateChief:
        """Orbit of the chief."""
        return OblateChief(self.elements)

    @property
    def period(self) -> float:
        """Nodal period of the chief, s."""
        return self.chief.period

    @property
    def longest_step(self) -> float:
        """Longest integration step, s, set by the chief's motion at its perigee."""
        return self.chief.longest_step

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t), exact: the Jacobian of the equations with J2, on the chief."""
        return OblateModel(self.chief).dynamics(time)

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix by the theory, to first order in J2."""
        mean, start = _state_from_mean_elements(self.chief, time)
        _, end = _state_from_mean_elements(self.chief, time + duration)
        phi: Array = end @ secular_transition(mean, duration) @ np.linalg.inv(start)
        return phi

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (6, 6) by the theory, and Gamma (6, 3) by integration."""
        _, gamma = super().discretise(time, tick)
        return self.transition(time, tick), gamma

    def bounded(self, time: float, state: Array) -> Array:
        """(6,) state with the along-track rate for which the mean latitudes, nodes included, do not drift apart."""
        mean, matrix = _state_from_mean_elements(self.chief, time)
        slopes = secular_slopes(mean)
        row = (slopes[1] + math.cos(mean.inclination) * slopes[5]) @ np.linalg.inv(matrix)
        result = np.array(state, dtype=np.float64)
        result[4] -= row @ result / row[4]
        return result


@lru_cache(maxsize=64)
def _state_from_mean_elements(chief: OblateChief, time: float) -> tuple[Elements, Array]:
    """Mean elements, and the map Sigma D (6, 6) from differences [a, lambda, i, q1, q2, Omega] of them."""
    osculating = chief.inertial(time)
    mean = mean_state(osculating)
    size, speed = math.sqrt(mean[:3] @ mean[:3]), math.sqrt(mean[3:] @ mean[3:])
    steps = DIFFERENCE * np.repeat([size, speed], 3)
    short = np.empty((6, 6))  # derivative of the short-period perturbations of an inertial state
    for column, step in enumerate(np.diag(steps)):
        ahead, behind = mean + step, mean - step
        added = (osculating_state(ahead) - ahead) - (osculating_state(behind) - behind)
        short[:, column] = added / (2.0 * steps[column])
    elements = elements_from_state(mean)
    of_mean = hill_transform_inverse(mean) @ sigma(elements) @ true_from_mean_latitude(elements)
    matrix = hill_transform(osculating) @ (np.eye(6) + short) @ of_mean
    matrix.setflags(write=False)
    return elements, matrix
