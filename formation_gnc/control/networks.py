"""The two networks by which LQR learns in flight what its model leaves out (Joshi 8).

All in units in which the regulator's states, thrust, time and cost are of order one.
"""

from dataclasses import dataclass

import numpy as np

from formation_gnc.types import Matrix, Vector

FORCED = np.eye(6)[3:]
"""(3, 6) acceleration to rate of change of the state."""

TERMS = 14
"""Functions that the identifying network sums."""


@dataclass(frozen=True)
class Regulator:
    """The baseline: LQR on a linear model."""

    dynamics: Matrix
    """(6, 6) A."""
    state_weight: Matrix
    """(6, 6) Q."""
    input_weight: Matrix
    """(3, 3) R."""
    cost_to_go: Matrix
    """(6, 6) P of Joshi (8.5)."""

    def thrust(self, error: Vector, costate: Vector) -> Vector:
        """(3,) acceleration against an error (6,), with a costate (6,) beyond P error."""
        total = self.cost_to_go @ error + costate
        return np.asarray(-np.linalg.solve(self.input_weight, total[3:]))


class Networks:
    """NN2, which identifies the acceleration d that the model lacks, and NN1, which gives the costate for it.

    NN2 is a sum of known functions of the state and the time with unknown weights, one set per axis: the
    kinematics have nothing to learn. A virtual deputy flies the model and the sum and is held to the true
    one; what it is off by corrects the weights by the law that makes Lyapunov's function fall (8.10), (8.25).

    NN1 is a sum of Gaussians of the error, one about the target and one at unit distance either way along
    every state. It is taught the costate that the equation (8.29), stepped back from where the model with d
    leads, has beyond that of the regulator, and moves by (8.8).

    Both start from zero: the law starts as LQR.
    """

    def __init__(self, regulator: Regulator, identification_time: float, inertia: float) -> None:
        """Networks for a regulator, with the time in which d is learnt and R1 of (8.8)."""
        self._regulator = regulator
        self._time = identification_time
        self._inertia = inertia
        self._centres = np.vstack([np.zeros((1, 6)), np.eye(6), -np.eye(6)])
        self.model_weights: Matrix = np.zeros((TERMS, 3))
        self.costate_weights: Matrix = np.zeros((len(self._centres), 6))
        self.virtual: Vector = np.zeros(3)
        """(3,) velocity of the virtual deputy."""

    @property
    def largest_weight(self) -> float:
        """Magnitude of the largest weight; NaN when one is not a number."""
        return float(np.max([np.abs(each).max() for each in (self.model_weights, self.costate_weights)]))

    def costate(self, error: Vector) -> Vector:
        """(6,) what NN1 adds to the regulator's costate at an error (6,)."""
        return np.asarray(self._gaussians(error) @ self.costate_weights)

    def thrust(self, error: Vector) -> Vector:
        """(3,) acceleration for the regulator's costate and the additional one."""
        return self._regulator.thrust(error, self.costate(error))

    def remember(self, others: "Networks") -> None:
        """Go on with the weights of other networks."""
        self.model_weights, self.costate_weights = others.model_weights, others.costate_weights

    def meet(self, error: Vector) -> None:
        """Put the virtual deputy where the true one is: at the start, and when the target leaps."""
        self.virtual = error[3:].copy()

    def identify(self, error: Vector, functions: Vector, slopes: Matrix, tick: float) -> None:
        """Correct NN2 by what the virtual deputy is off, given its functions (p,) and their slopes (p, 6).

        gamma and Theta of (8.25) are one over the number of states, and beta is such that d follows what is
        there with a double pole at -1 / identification_time, however large the functions are.
        """
        metric = np.linalg.solve(np.eye(len(functions)) + slopes @ slopes.T / 6.0, functions)
        share = tick / self._time**2 / (metric @ functions)
        self.model_weights = self.model_weights + share * np.outer(metric, error[3:] - self.virtual)

    def fly(self, error: Vector, functions: Vector, thrust: Vector, tick: float) -> Vector:
        """(6,) error at the next tick as the model with d predicts it; moves the virtual deputy there."""
        rate = self._regulator.dynamics @ error
        rate[3:] += thrust + functions @ self.model_weights
        held = 2.0 / self._time * (error[3:] - self.virtual)
        self.virtual = self.virtual + tick * (rate[3:] + held)
        return error + tick * rate

    def teach(self, error: Vector, following: Vector, slopes: Matrix, tick: float) -> None:
        """Correct NN1 at an error, given the one that follows and the slopes of NN2's functions."""
        regulator = self._regulator
        later = regulator.cost_to_go @ following + self.costate(following)
        gradient = regulator.dynamics + FORCED.T @ (self.model_weights.T @ slopes)
        wanted = later + tick * (regulator.state_weight @ error + gradient.T @ later)
        missing = wanted - regulator.cost_to_go @ error - self.costate(error)
        gaussians = self._gaussians(error)
        share = gaussians / (self._inertia + gaussians @ gaussians)
        self.costate_weights = self.costate_weights + np.outer(share, missing)

    def _gaussians(self, error: Vector) -> Vector:
        """(13,) of unit width."""
        return np.asarray(np.exp(-0.5 * np.sum((error - self._centres) ** 2, axis=1)))


def functions(state: Vector, radius: float, latitude: float) -> tuple[Vector, Matrix]:
    """What NN2 sums, (14,), and their slopes by the state (14, 6): Joshi 8.3.

    One; sine and cosine of the argument of latitude and of its double, for J2 and the eccentricity; the
    state; and the place times the power series of gravity in psi (8.30) to the fourth order, over its slope.

    Args:
        state: (6,) relative to the chief.
        radius: of the chief's orbit, in the same unit of length.
        latitude: argument of latitude, rad.
    """
    place = state[:3]
    psi = -(2.0 * place[0] + place @ place / radius) / radius
    slope_of_psi = -2.0 * (np.array([radius, 0.0, 0.0]) + place) / radius**2
    scale = 0.5 * radius
    series = scale * psi * (1.0 + psi * (1.0 + psi * (1.0 + psi)))
    slope = scale * (1.0 + psi * (2.0 + psi * (3.0 + 4.0 * psi))) * slope_of_psi
    angles = latitude * np.array([1.0, 2.0])
    values = np.concatenate([[1.0], np.sin(angles), np.cos(angles), state, series * place])
    slopes = np.zeros((TERMS, 6))
    slopes[5:11] = np.eye(6)
    slopes[11:, :3] = series * np.eye(3) + np.outer(place, slope)
    return values, slopes
