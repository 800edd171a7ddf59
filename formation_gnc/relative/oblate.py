"""The nonlinear equations of relative motion with differential J2."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.frames import hill_rate, inertial_from_relative
from formation_gnc.orbit.mean import mean_state, secular_rates
from formation_gnc.relative.chief import Chief, ChiefState, OblateChief
from formation_gnc.relative.factorisation import FACTORISATIONS, oblateness
from formation_gnc.relative.kernels import motion
from formation_gnc.relative.model import NO_THRUST, ON_THE_CHIEF, Array
from formation_gnc.relative.nonlinear import FactorisedModel, jacobian


@dataclass(frozen=True)
class OblateModel(FactorisedModel):
    """Relative motion of two satellites under point-mass gravity and J2.

    Exact at any separation and eccentricity with an `OblateChief`. With a `KeplerChief` it is Joshi's model: J2
    acts on the difference of the two, while the chief stays on its ellipse.

    Assumes: no other force, a chief that does not manoeuvre. Source: Joshi (3.47), (3.48), with the
    corrections of docs/theory/errata.md.
    """

    has_j2 = True
    is_exact_under_j2 = True

    chief: Chief

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """About the chief's orbit under J2."""
        return cls(OblateChief(chief))

    def factorised(self, state: Array, chief: ChiefState, method: str = "sdc1") -> Array:
        """(..., 6, 6) matrix A(x) of point-mass gravity, plus that of differential J2."""
        matrix = FACTORISATIONS[method](state, chief)
        matrix[..., 3:, :3] += oblateness(state, chief)
        return matrix

    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) Jacobian at the state: what Joshi (6.27)-(6.46) are meant to be."""
        chief = self.chief.at(time)
        matrix = jacobian(state, chief)
        matrix[3:, :3] += oblate_gradient(state, chief)
        return matrix

    def motion(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> tuple[Array, Array]:
        """`derivative` (6,) and `dynamics` (6, 6) at one state, compiled."""
        return motion(state, acceleration, self.chief.at(time), oblate=True)

    def bounded(self, time: float, state: Array) -> Array:
        """(6,) state with the along-track rate for which the mean latitudes, nodes included, do not drift apart.

        The condition is on mean elements: J2 also rotates the perigee of the relative orbit, so that a motion
        which repeats after one revolution drifts. Valid to first order in J2. About a `KeplerChief`, where no
        motion with J2 is bounded, the along-track position repeats after one revolution.
        """
        if not isinstance(self.chief, OblateChief):
            return super().bounded(time, state)
        inertial = self.chief.inertial(time)
        here = elements_from_state(mean_state(inertial))
        node_rate, *rates = secular_rates(here)
        transverse = hill_rate(inertial) * math.sqrt(inertial[:3] @ inertial[:3])
        slope = -3.0 * transverse / math.sqrt(MU * here.semi_major_axis)  # of n by vy: -3 n a v / mu
        result = np.array(state, dtype=np.float64)
        for _ in range(50):  # Newton's method with the slope without J2
            deputy = elements_from_state(mean_state(inertial_from_relative(inertial, result)))
            node, *others = secular_rates(deputy)
            excess = sum(others) - sum(rates) + math.cos(here.inclination) * (node - node_rate)
            change = -excess / slope
            result[4] += change
            if abs(change) < 1e-12:
                break
        return result


def oblate_gradient(state: Array, chief: ChiefState) -> Array:
    """(3, 3) gradient of the J2 acceleration at the deputy, in the chief's Hill frame."""
    place = np.array([chief.radius + state[0], state[1], state[2]])
    square = float(place @ place)
    unit = place / square**0.5
    sine = float(unit @ chief.pole)
    cross = np.outer(unit, chief.pole)
    strength = 1.5 * J2 * chief.mu * EARTH_RADIUS**2 / square**2.5
    gradient: Array = -strength * (
        (1.0 - 5.0 * sine**2) * np.eye(3)
        + 5.0 * (7.0 * sine**2 - 1.0) * np.outer(unit, unit)
        - 10.0 * sine * (cross + cross.T)
        + 2.0 * np.outer(chief.pole, chief.pole)
    )
    return gradient
