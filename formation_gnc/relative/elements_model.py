"""Relative motion by mean relative orbital elements under J2."""

from dataclasses import dataclass, replace
from functools import cache
from math import tau
from typing import Self

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.mean import advanced, mean_elements, mean_state, secular_rates
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.element_differences import check_node
from formation_gnc.relative.model import ON_THE_CHIEF, Array, LinearModel
from formation_gnc.relative.nonlinear import jacobian
from formation_gnc.relative.relative_elements import hill_matrix, j2_transition, mean_relative_elements

TURN = 1e-4
"""Turn of the perigee by which the map is differentiated, rad: a relative error of 1e-9."""


@dataclass(frozen=True)
class RelativeElementsModel(LinearModel):
    """Linear relative motion about the mean orbit of a chief of any eccentricity, at its secular rates under J2.

    Mean relative elements drift by Koenig, Guffanti and D'Amico's transition matrix, and map to the Hill state by the
    geometry of the mean orbits: all in closed form.

    Assumes: separation much smaller than the radius; no equatorial chief. Leaves out the short-period perturbations
    of J2, by which states differ a part in a thousand; a target path by this model has them (guidance.targets).

    Raises:
        OrbitError: an inclination within a milliradian of 0 or pi.
    """

    has_closed_form = True
    has_j2 = True

    elements: Elements
    """Mean elements of the chief at time zero."""

    def __post_init__(self) -> None:
        """Reject a chief without a node."""
        check_node(self.elements, "relative elements")

    @classmethod
    @cache  # slot assignment builds hundreds of paths about one chief
    def about(cls, chief: Elements) -> "RelativeElementsModel":
        """About the mean orbit of the chief's osculating elements."""
        return cls(mean_elements(chief))

    def chief_at(self, time: float) -> Elements:
        """Mean elements of the chief at a time (s)."""
        return advanced(self.elements, time)

    @property
    def period(self) -> float:
        """Mean nodal period of the chief, s."""
        return tau / sum(secular_rates(self.elements)[1:])

    @property
    def longest_step(self) -> float:
        """Longest integration step, s, set by the chief's motion at its perigee."""
        return KeplerChief.of(self.elements).longest_step

    def anchored(self, chief: Array, time: float) -> Self:
        """About the mean orbit of an inertial state (6,) at a time (s); the same if that has no node."""
        try:
            return replace(self, elements=advanced(elements_from_state(mean_state(chief)), -time))
        except OrbitError:
            return self

    def averaged(self, chief: Array, state: Array) -> Array:
        """(6,) relative state of the mean orbits of an inertial state (6,) and of one relative to it (6,)."""
        try:
            return hill_matrix(elements_from_state(mean_state(chief))) @ mean_relative_elements(chief, state)
        except OrbitError:
            return state

    def phase_rates(self, time: float) -> tuple[float, float]:
        """Rate of the chief's true anomaly, and of its argument of latitude, rad/s."""
        orbit = KeplerChief.of(self.chief_at(time)).at(0.0)
        return orbit.angular_rate, orbit.angular_rate + secular_rates(self.elements)[1]

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t) of the transition: that of the mean ellipse, which turns, and the drift."""
        chief = self.chief_at(time)
        here, n, (_, perigee, anomaly) = hill_matrix(chief), chief.mean_motion, secular_rates(chief)
        by_anomaly = jacobian(ON_THE_CHIEF, KeplerChief.of(chief).at(0.0)) @ here / n
        by_anomaly[:, 0] += 1.5 * here[:, 1]
        ahead, behind = (
            hill_matrix(replace(chief, argument_of_perigee=chief.argument_of_perigee + turn)) for turn in (TURN, -TURN)
        )
        drift = 0.5 * (j2_transition(chief, 1.0) - j2_transition(chief, -1.0))
        change = anomaly * by_anomaly + perigee / (2.0 * TURN) * (ahead - behind) + here @ drift
        return np.asarray(np.linalg.solve(here.T, change.T).T)

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix, in closed form."""
        if not duration:
            return np.eye(6)
        start = self.chief_at(time)
        moved = hill_matrix(advanced(start, duration)) @ j2_transition(start, duration)
        return np.asarray(np.linalg.solve(hill_matrix(start).T, moved.T).T)

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (6, 6) in closed form, and Gamma (6, 3) by integration."""
        _, gamma = super().discretise(time, tick)
        return self.transition(time, tick), gamma

    def bounded(self, time: float, state: Array) -> Array:
        """(..., 6) state with the along-track rate for which dlambda does not drift."""
        chief = self.chief_at(time)
        drift = j2_transition(chief, 1.0)[1] - np.eye(6)[1]
        row = np.linalg.solve(hill_matrix(chief).T, drift)
        result = np.array(state, dtype=np.float64)
        result[..., 4] -= result @ row / row[4]
        return result
