"""H-infinity control by mixed-sensitivity synthesis."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag, solve_discrete_lyapunov

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.linear import LinearController
from formation_gnc.control.mixed_sensitivity import MixedSensitivityProblem, WeightingFunction
from formation_gnc.control.models import DESIGN_MODELS, TIME_INVARIANT_MODELS
from formation_gnc.control.recovery import RecoveryTrajectory
from formation_gnc.control.riccati import spectral_radius
from formation_gnc.control.weights import require_in_plane
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import Matrix, Vector

ROUNDING = 1.0 + 1e-9
"""Share of the limit above which a force saturates: one handed over at the limit does not."""


@dataclass(frozen=True)
class HinfParameters:
    """Weighting functions, with a value for each Hill axis, and synthesis options."""

    model: str = parameter(
        "hill",
        choices=TIME_INVARIANT_MODELS,
        in_flight=True,
        doc="relative-motion model of the design",
    )
    form: str = parameter(
        "output",
        choices=("output", "full_information"),
        in_flight=True,
        doc="output: feedback of the relative position; full_information: feedback of the whole estimated state",
    )
    bandwidth: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3), unit="rad/s", length=3, above=0.0, in_flight=True, doc="w_P: w_B, required bandwidth"
    )
    sensitivity_peak: tuple[float, ...] = parameter(
        (2.0, 2.0, 2.0),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_P: M, bound on the sensitivity peak",
    )
    steady_error: tuple[float, ...] = parameter(
        (0.03, 0.03, 0.03),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_P: A, bound on the steady-state sensitivity",
    )
    uncertainty: tuple[float, ...] = parameter(
        (0.3, 0.3, 0.3),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: r_0, relative uncertainty at low frequency",
    )
    uncertainty_peak: tuple[float, ...] = parameter(
        (2.0, 2.0, 2.0),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: r_inf, relative uncertainty at high frequency",
    )
    uncertainty_time: tuple[float, ...] = parameter(
        (50.0, 50.0, 50.0),
        unit="s",
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: tau, inverse of the frequency at which the relative uncertainty reaches 1",
    )
    thrust: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3),
        unit="N/m",
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_u: force per metre of position disturbance with unit cost",
    )
    disturbance: float = parameter(
        3e-6,
        unit="1/s^2",
        minimum=0.0,
        in_flight=True,
        doc="acceleration disturbance equivalent to a metre of position disturbance",
    )
    pole_shift: float = parameter(
        0.0,
        unit="1/s",
        minimum=0.0,
        in_flight=True,
        doc="shift of the plant's poles to the right in the design (Neokleous: 0.1 / min)",
    )
    gamma_margin: float = parameter(
        0.1, above=0.0, in_flight=True, doc="relative distance of the design's gamma above the optimal gamma"
    )


class HInfinityController(Controller[HinfParameters]):
    """Mixed-sensitivity H-infinity controller of the position error.

    Designed on a time-invariant relative-motion model with the weighting functions w_P, w_T (also w_I) and w_u
    of Neokleous (5.41), (5.42), (6.6), per channel; discretised exactly with the error held over a tick. The
    full-information form is the central state feedback for an acceleration disturbance; it integrates the
    states of w_P and w_T.

    Plant poles on the imaginary axis are regularised by a disturbance at the plant's input, or by Neokleous'
    pole shift, which then remains in the controller.

    At activation the controller's states are those of least closed-loop cost-to-go that yield the force
    commanded before. When the thrust would saturate (anti-windup), the error becomes a trajectory to the target
    that the thrusters can fly (`RecoveryTrajectory`), and the controller acts on the difference from it.

    Assumes: near-circular chief; separation much smaller than its radius; a target that needs little thrust.
    """

    Parameters = HinfParameters

    def __init__(self, parameters: HinfParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Synthesise.

        Raises:
            DesignError: no feasible gamma, an unstable sampled loop, or no radial or along-track thruster.
        """
        require_in_plane("hinf", vehicle)
        model = DESIGN_MODELS[parameters.model](common)
        own = {name: np.array(value) for name, value in vars(parameters).items() if isinstance(value, tuple)}
        self.problem = MixedSensitivityProblem(
            model.dynamics(0.0),
            WeightingFunction.performance(own["bandwidth"], own["sensitivity_peak"], own["steady_error"]),
            WeightingFunction.uncertainty(own["uncertainty_time"], own["uncertainty"], own["uncertainty_peak"]),
            vehicle.mass / own["thrust"],
            parameters.pole_shift,
            parameters.disturbance,
        )
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        self.recovery = RecoveryTrajectory(model, common.tick)
        """The recovery from saturation in progress."""
        self._force = np.zeros(3)
        self._states: Vector | None = None
        try:
            self.continuous, self.optimal_gamma, self.gamma = self.problem.synthesise(
                parameters.form == "full_information", parameters.gamma_margin
            )
            self.sampled = self.continuous.discretised(common.tick)
            phi, gamma = model.discretise(0.0, common.tick)
            self._design_activation(phi, gamma)
        except DesignError as error:
            raise DesignError(f"hinf: {error}") from error

    def _design_activation(self, phi: Matrix, gamma: Matrix) -> None:
        """Set the maps of `_states_for`: cost-to-go V of the sampled loop, minimised over the controller's states.

        V solves the Lyapunov equation with the stage cost |y|^2 + |w_u u|^2.
        """
        c, d = self.sampled.c, self.sampled.d
        output = np.eye(6)[: self.sampled.b.shape[1]]
        loop = self.sampled.closed_loop(phi, gamma)
        if not (radius := spectral_radius(loop)) < 1.0:
            raise DesignError(
                f"the sampled closed loop is unstable (spectral radius {radius:.6f}); "
                "a shorter tick, less bandwidth, or a larger pole_shift or disturbance may help"
            )
        feedback = np.hstack([d @ output, c])
        cost = block_diag(np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), np.zeros_like(self.sampled.a))
        cost += feedback.T @ np.diag(self.problem.effort**2) @ feedback
        # Scaling of the arbitrary controller coordinates: by their effect on the force.
        unit = np.concatenate(
            [np.repeat([1.0, self.problem.rate], 3), self.problem.rate**2 / np.linalg.norm(c, axis=0)]
        )
        to_go = solve_discrete_lyapunov((loop * np.outer(1.0 / unit, unit)).T, cost * np.outer(unit, unit))
        own, mixed = to_go[6:, 6:], to_go[6:, :6]
        values, vectors = np.linalg.eigh(0.5 * (own + own.T))
        inverse = (vectors / np.maximum(values, 1e-12 * values[-1])) @ vectors.T
        scaled_c = c * unit[6:]
        to_force = inverse @ scaled_c.T @ np.linalg.inv(scaled_c @ inverse @ scaled_c.T)
        free = -inverse @ mixed
        from_error = ((free - to_force @ scaled_c @ free) / unit[:6]) * unit[6:, None]
        self._from_force = to_force * unit[6:, None]
        self._from_error = from_error - self._from_force @ d @ output

    def figures(self) -> dict[str, Any]:
        """Optimal gamma and that of the design, order and poles of the controller."""
        return {
            "optimal gamma": self.optimal_gamma,
            "gamma": self.gamma,
            "states": len(self.sampled.a),
            "controller poles, real parts [1/s]": sorted(np.linalg.eigvals(self.continuous.a).real.tolist()),
        }

    def linear(self, time: int) -> LinearController:
        """The sampled controller."""
        return self.sampled

    def singular_values(self, frequency: Vector) -> dict[str, Matrix]:
        """S, T and KS of the continuous loop, and their bounds at the design's gamma."""
        values = self.problem.singular_values(self.continuous, frequency)
        effort = np.ones((len(frequency), 1)) / self.problem.effort
        return {
            "S": values["S"],
            "T": values["T"],
            "KS [N/m]": self._mass * values["KS"],
            "gamma / w_P": self.gamma / self.problem.performance.at(frequency),
            "gamma / w_T": self.gamma / self.problem.uncertainty.at(frequency),
            "gamma / w_u [N/m]": self._mass * self.gamma * effort,
        }

    def activate(self, handover: Handover) -> None:
        """Start from the force commanded before."""
        self._force, self._states = handover.force, None
        self.recovery.end()

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Output of the controller, whose states advance by a tick, plus the recovery's acceleration."""
        error = estimate.relative_state - target.relative_state
        limit, size = self._limit / estimate.mass, self.sampled.b.shape[1]
        recovery = self.recovery.acceleration()
        off = error if self.recovery.state is None else error - self.recovery.state
        if self._states is None:
            self._states = self._states_for(off, self._force / estimate.mass - recovery)
        acceleration = recovery + self.sampled.c @ self._states + self.sampled.d @ off[:size]
        if (np.abs(acceleration) > ROUNDING * limit)[limit > 0.0].any():
            self.recovery.begin(error, limit, 0.0)
            acceleration = self.recovery.acceleration()
            off, self._states = np.zeros(6), np.zeros_like(self._states)
        states = self.sampled.a @ self._states + self.sampled.b @ off[:size]
        # Reinitialise after an overflow.
        self._states = states if np.isfinite(states).all() else None
        self.recovery.advance()
        return Command(estimate.mass * acceleration)

    def _states_for(self, error: Vector, acceleration: Vector) -> Vector:
        """Controller states of least cost-to-go that yield an acceleration (3,) at an error (6,)."""
        states: Vector = self._from_error @ error + self._from_force @ acceleration
        return states
