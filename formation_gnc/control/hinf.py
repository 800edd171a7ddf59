"""H-infinity control."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag, solve_discrete_lyapunov

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.linear import LinearController
from formation_gnc.control.mixed_sensitivity import Problem, Weight
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.riccati import spectral_radius
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class HinfParameters:
    """Bounds on the closed loop, each with three values: one per Hill axis."""

    model: str = parameter(
        "hill",
        choices=("hill", "schweighart_sedwick"),
        in_flight=True,
        doc="relative motion that the law is designed on",
    )
    form: str = parameter(
        "output",
        choices=("output", "full_information"),
        in_flight=True,
        doc="output: from the three relative positions; full_information: from the whole estimated state",
    )
    bandwidth: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3), unit="rad/s", length=3, above=0.0, in_flight=True, doc="w_P: w_B, least bandwidth"
    )
    sensitivity_peak: tuple[float, ...] = parameter(
        (2.0, 2.0, 2.0),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_P: M, largest sensitivity at any frequency",
    )
    steady_error: tuple[float, ...] = parameter(
        (0.03, 0.03, 0.03),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_P: A, sensitivity to what stays constant",
    )
    uncertainty: tuple[float, ...] = parameter(
        (0.3, 0.3, 0.3),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: r_0, relative uncertainty of slow motion",
    )
    uncertainty_peak: tuple[float, ...] = parameter(
        (2.0, 2.0, 2.0),
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: r_inf, relative uncertainty of fast motion",
    )
    uncertainty_time: tuple[float, ...] = parameter(
        (50.0, 50.0, 50.0),
        unit="s",
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_T: tau, inverse of the frequency at which the uncertainty reaches 1",
    )
    thrust: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3),
        unit="N/m",
        length=3,
        above=0.0,
        in_flight=True,
        doc="w_u: force per metre of disturbance that weighs one",
    )
    disturbance: float = parameter(
        3e-6,
        unit="1/s^2",
        minimum=0.0,
        in_flight=True,
        doc="acceleration that counts like a metre of disturbance",
    )
    pole_shift: float = parameter(
        0.0,
        unit="1/s",
        minimum=0.0,
        in_flight=True,
        doc="shift of the plant's poles in the design (Neokleous: 0.1 / min)",
    )
    gamma_margin: float = parameter(
        0.1, above=0.0, in_flight=True, doc="how far above the best gamma the law is designed, relative to it"
    )


class HInfinityController(Controller):
    """Mixed-sensitivity H-infinity controller of the position error.

    Designed on a time-invariant relative-motion model with the weights w_P, w_T (also w_I) and w_u of
    Neokleous (5.41), (5.42), (6.6), per channel; discretised exactly with the error held over a tick. The
    full-information form is the central state feedback for an acceleration disturbance, with the states of
    w_P and w_T integrated on board.

    The poles on the imaginary axis are dealt with by a disturbance at the input, or by Neokleous' shift of
    the plant's poles, which the controller then keeps.

    When it takes over, and whenever the thrust limit cuts its answer (anti-wind-up), the controller's states
    are set anew: of all states that give just the force that flies, those from which the closed loop costs
    least.

    Assumes: near-circular chief, separation much smaller than its radius, a target that needs little thrust
    to follow, an error that the thrusters can answer: far beyond, no linear law of high gain recovers.
    """

    Parameters = HinfParameters

    def __init__(self, parameters: HinfParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Synthesise; raises DesignError when no gamma is feasible or the sampled loop is not stable."""
        model = DESIGN_MODELS[parameters.model](common)
        bounds = {name: np.array(value) for name, value in vars(parameters).items() if isinstance(value, tuple)}
        self.problem = Problem(
            model.dynamics(0.0),
            Weight.performance(bounds["bandwidth"], bounds["sensitivity_peak"], bounds["steady_error"]),
            Weight.uncertainty(bounds["uncertainty_time"], bounds["uncertainty"], bounds["uncertainty_peak"]),
            vehicle.mass / bounds["thrust"],
            parameters.pole_shift,
            parameters.disturbance,
        )
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        self._force = np.zeros(3)
        self._states: Vector | None = None
        try:
            self.continuous, self.best_gamma, self.gamma = self.problem.synthesise(
                parameters.form == "full_information", parameters.gamma_margin
            )
            self.sampled = self.continuous.discretised(common.tick)
            self._set_restart(*model.discretise(0.0, common.tick))
        except DesignError as error:
            raise DesignError(f"hinf: {error}") from error

    def _set_restart(self, phi: np.ndarray, gamma: np.ndarray) -> None:
        """States of least cost-to-go for a state error x and an acceleration u: xi = X x + U u."""
        c, d = self.sampled.c, self.sampled.d
        seen = np.eye(6)[: self.sampled.b.shape[1]]
        loop = self.sampled.closed_loop(phi, gamma)
        if not (radius := spectral_radius(loop)) < 1.0:
            raise DesignError(
                f"the loop closed once a tick is not stable (largest pole {radius:.6f}); "
                "a shorter tick, less bandwidth, or a larger pole_shift or disturbance may do"
            )
        answer = np.hstack([d @ seen, c])
        cost = block_diag(np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), np.zeros_like(self.sampled.a))
        cost += answer.T @ np.diag(self.problem.effort**2) @ answer
        # The controller's own coordinates are arbitrary: measured by what each does to the force, they are
        # alike.
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
        self._from_force = to_force * unit[6:, None]
        self._from_error = ((free - to_force @ scaled_c @ free) / unit[:6]) * unit[
            6:, None
        ] - self._from_force @ d @ seen

    def figures(self) -> dict[str, Any]:
        """What gamma was reached, and how fast the controller is."""
        return {
            "best gamma": self.best_gamma,
            "gamma": self.gamma,
            "states": len(self.sampled.a),
            "controller poles, real parts [1/s]": sorted(np.linalg.eigvals(self.continuous.a).real.tolist()),
        }

    def linear(self, time: int) -> LinearController:
        """The sampled controller."""
        return self.sampled

    def singular_values(self, frequency: Vector) -> dict[str, Matrix]:
        """S, T and KS of the continuous loop, and what gamma allows them."""
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
        """Start from the force that flew before."""
        self._force = handover.force

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force that the controller's states give now, and those states a tick on."""
        error = estimate.relative_state - target.relative_state
        seen = error[: self.sampled.b.shape[1]]
        if self._states is None:
            self._states = self._restarted(error, self._force / estimate.mass)
        force = estimate.mass * (self.sampled.c @ self._states + self.sampled.d @ seen)
        flown = np.clip(force, -self._limit, self._limit)
        if (flown != force).any():
            self._states = self._restarted(error, flown / estimate.mass)
        states = self.sampled.a @ self._states + self.sampled.b @ seen
        # After numbers that overflow, start afresh.
        self._states = states if np.isfinite(states).all() else None
        return Command(force)

    def _restarted(self, error: Vector, acceleration: Vector) -> Vector:
        states: Vector = self._from_error @ error + self._from_force @ acceleration
        return states
