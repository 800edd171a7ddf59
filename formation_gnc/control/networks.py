"""The two neural networks of the adaptive LQR, trained in flight (Joshi 8).

In units in which the regulator's states, thrust, time and cost are of order one.
"""

from dataclasses import dataclass

import numpy as np

from formation_gnc.types import Matrix, Vector

FORCED = np.eye(6)[3:]
"""(3, 6) transpose of the input matrix B."""

BASIS_SIZE = 14
"""Number of basis functions of the identification network."""


@dataclass(frozen=True)
class Regulator:
    """The baseline LQR on a linear model."""

    dynamics: Matrix
    """(6, 6) A."""
    state_weight: Matrix
    """(6, 6) Q."""
    input_weight: Matrix
    """(3, 3) R."""
    cost_to_go: Matrix
    """(6, 6) P of Joshi (8.5)."""

    def thrust(self, error: Vector, costate: Vector) -> Vector:
        """(3,) acceleration for an error (6,) and a costate (6,) in addition to P error."""
        total = self.cost_to_go @ error + costate
        return np.asarray(-np.linalg.solve(self.input_weight, total[3:]))


class Networks:
    """NN2, which identifies the unmodelled acceleration d, and NN1, which gives the costate that it adds.

    NN2 is linear in its weights, one set per axis, over known basis functions of state and time. An observer
    propagates the model with the estimate of d; its velocity error drives the weights by the Lyapunov-stable
    update law (8.10), (8.25).

    NN1 is a radial-basis network of the error: Gaussians at the target and at unit distance either way along
    every state. Its training target is the part of the costate beyond the regulator's that the costate
    equation (8.29) gives one step back from the predicted error; its update law is (8.8).

    All weights start at zero, where the law is the LQR.
    """

    def __init__(self, regulator: Regulator, identification_time: float, inertia: float) -> None:
        """Networks for a regulator; `identification_time` is the time constant of d, `inertia` is R1 of (8.8)."""
        self._regulator = regulator
        self._time_constant = identification_time
        self._inertia = inertia
        self._centres = np.vstack([np.zeros((1, 6)), np.eye(6), -np.eye(6)])
        self.model_weights: Matrix = np.zeros((BASIS_SIZE, 3))
        self.costate_weights: Matrix = np.zeros((len(self._centres), 6))
        self.observed_velocity: Vector = np.zeros(3)
        """(3,) velocity error from the target as predicted by the observer (Joshi's virtual deputy)."""

    @property
    def largest_weight(self) -> float:
        """Magnitude of the largest weight; NaN if any weight is NaN."""
        return float(np.max([np.abs(each).max() for each in (self.model_weights, self.costate_weights)]))

    def costate(self, error: Vector) -> Vector:
        """(6,) output of NN1 at an error (6,): the costate in addition to the regulator's."""
        return np.asarray(self._gaussians(error) @ self.costate_weights)

    def thrust(self, error: Vector) -> Vector:
        """(3,) acceleration of the regulator with the additional costate."""
        return self._regulator.thrust(error, self.costate(error))

    def copy_weights(self, others: "Networks") -> None:
        """Take over the weights of other networks."""
        self.model_weights, self.costate_weights = others.model_weights, others.costate_weights

    def reset_observer(self, error: Vector) -> None:
        """Set the observer to the true error (6,): at the start, and after a jump of the target."""
        self.observed_velocity = error[3:].copy()

    def identify(self, error: Vector, basis: Vector, gradients: Matrix, tick: float) -> None:
        """Update NN2 by the observer's velocity error, given basis functions (p,) and their gradients (p, 6).

        gamma and Theta of (8.25) are one over the number of states; beta places a double pole of the estimate of
        d at -1 / identification_time, whatever the size of the basis functions.
        """
        metric = np.linalg.solve(np.eye(len(basis)) + gradients @ gradients.T / 6.0, basis)
        rate = tick / self._time_constant**2 / (metric @ basis)
        self.model_weights = self.model_weights + rate * np.outer(metric, error[3:] - self.observed_velocity)

    def predict(self, error: Vector, basis: Vector, thrust: Vector, tick: float) -> Vector:
        """(6,) error at the next tick by the model with d; advances the observer."""
        rate = self._regulator.dynamics @ error
        rate[3:] += thrust + basis @ self.model_weights
        injection = 2.0 / self._time_constant * (error[3:] - self.observed_velocity)
        self.observed_velocity = self.observed_velocity + tick * (rate[3:] + injection)
        return error + tick * rate

    def train(self, error: Vector, following: Vector, gradients: Matrix, tick: float) -> None:
        """Update NN1 at an error (6,), given the predicted next error (6,) and the gradients of NN2's basis."""
        regulator = self._regulator
        later = regulator.cost_to_go @ following + self.costate(following)
        jacobian = regulator.dynamics + FORCED.T @ (self.model_weights.T @ gradients)
        wanted = later + tick * (regulator.state_weight @ error + jacobian.T @ later)
        missing = wanted - regulator.cost_to_go @ error - self.costate(error)
        gaussians = self._gaussians(error)
        rate = gaussians / (self._inertia + gaussians @ gaussians)
        self.costate_weights = self.costate_weights + np.outer(rate, missing)

    def _gaussians(self, error: Vector) -> Vector:
        """(13,) Gaussians of unit width at an error (6,)."""
        return np.asarray(np.exp(-0.5 * np.sum((error - self._centres) ** 2, axis=1)))


def basis_functions(state: Vector, radius: float, latitude: float) -> tuple[Vector, Matrix]:
    """Basis functions of NN2 (14,) and their gradients with respect to the state (14, 6): Joshi 8.3.

    One; sine and cosine of the argument of latitude and of its double, for J2 and the eccentricity; the state;
    and the position times the power series of gravity in psi (8.30) to the fourth order, over its slope.

    Args:
        state: (6,) relative state.
        radius: radius of the chief's orbit, in the same unit of length.
        latitude: argument of latitude of the chief, rad.
    """
    position = state[:3]
    psi = -(2.0 * position[0] + position @ position / radius) / radius
    psi_gradient = -2.0 * (np.array([radius, 0.0, 0.0]) + position) / radius**2
    scale = 0.5 * radius
    series = scale * psi * (1.0 + psi * (1.0 + psi * (1.0 + psi)))
    series_gradient = scale * (1.0 + psi * (2.0 + psi * (3.0 + 4.0 * psi))) * psi_gradient
    angles = latitude * np.array([1.0, 2.0])
    basis = np.concatenate([[1.0], np.sin(angles), np.cos(angles), state, series * position])
    gradients = np.zeros((BASIS_SIZE, 6))
    gradients[5:11] = np.eye(6)
    gradients[11:, :3] = series * np.eye(3) + np.outer(position, series_gradient)
    return basis, gradients
