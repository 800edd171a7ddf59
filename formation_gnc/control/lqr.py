"""Linear quadratic regulator."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solve_discrete_are

from formation_gnc.control.controller import Command, Controller, Vehicle
from formation_gnc.errors import DesignError
from formation_gnc.interface import Estimate, Matrix, Target
from formation_gnc.mission import Mission
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel


@dataclass(frozen=True)
class LqrParameters:
    """Weights by Bryson's rule: each is the size that costs as much as any other."""

    position_error: tuple[float, ...] = parameter(
        (1.0, 1.0, 1.0), unit="m", length=3, above=0.0, in_flight=True, doc="position error that weighs one, per Hill axis"
    )
    velocity_error: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01), unit="m/s", length=3, above=0.0, in_flight=True, doc="velocity error that weighs one, per Hill axis"
    )
    thrust: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01), unit="N", length=3, above=0.0, in_flight=True, doc="force that weighs one, per Hill axis"
    )


class LinearQuadraticRegulator(Controller):
    """Discrete infinite-horizon LQR on Hill's equations.

    Tracks the target: u = -K (x - x_target), with K from the discrete algebraic Riccati equation
    (Neokleous 4.29-4.30, sign of 4.33 corrected) for Hill's equations, exactly discretised over a tick with held thrust.

    Assumes: near-circular chief, separation much smaller than its radius, a target that needs little thrust to follow.
    """

    Parameters = LqrParameters

    def __init__(self, parameters: LqrParameters, mission: Mission, vehicle: Vehicle) -> None:
        """Solve for the gain; raises DesignError when the Riccati equation has no stabilising solution."""
        model = HillModel(mission.mean_motion)
        phi, gamma = model.discretise(0.0, mission.tick)
        errors = np.array(parameters.position_error + parameters.velocity_error)
        accelerations = np.array(parameters.thrust) / vehicle.mass
        self.gain = lqr_gain(phi, gamma, np.diag(errors**-2.0), np.diag(accelerations**-2.0))

    def command(self, estimate: Estimate, target: Target) -> Command:
        """The force that the gain asks for against the estimated error."""
        error = estimate.relative_state - target.relative_state
        return Command(-estimate.mass * (self.gain @ error))


def lqr_gain(phi: Matrix, gamma: Matrix, state_weight: Matrix, input_weight: Matrix) -> Matrix:
    """Gain K (3, 6) of the discrete infinite-horizon LQR u = -K x for x' = phi x + gamma u.

    Minimises the sum of x' Q x + u' R u. Solved in units of the weights themselves, since SI numbers of orbital motion span
    ten orders of magnitude and the Riccati solver would fail on them.

    Raises:
        DesignError: no stabilising solution.
    """
    state_scale = np.sqrt(np.diag(state_weight))
    input_scale = np.sqrt(np.diag(input_weight))
    scaled_phi = phi * np.outer(state_scale, 1.0 / state_scale)
    scaled_gamma = gamma * np.outer(state_scale, 1.0 / input_scale)
    q = state_weight / np.outer(state_scale, state_scale)
    r = input_weight / np.outer(input_scale, input_scale)
    try:
        p = solve_discrete_are(scaled_phi, scaled_gamma, q, r)
    except (LinAlgError, ValueError) as error:
        raise DesignError(f"lqr: no stabilising gain for these weights ({error})") from error
    scaled_gain = np.linalg.solve(r + scaled_gamma.T @ p @ scaled_gamma, scaled_gamma.T @ p @ scaled_phi)
    if np.abs(np.linalg.eigvals(scaled_phi - scaled_gamma @ scaled_gain)).max() >= 1.0:
        raise DesignError("lqr: the closed loop of these weights is not stable")
    gain: Matrix = scaled_gain * np.outer(1.0 / input_scale, state_scale)
    return gain
