"""Infinite-horizon state-dependent Riccati equation (SDRE) control."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.feed_forward import FeedForward
from formation_gnc.control.fixed_endpoint_lq import discretise, state_dependent
from formation_gnc.control.integral import IntegralWeights, integrated, with_integral
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.models import PLAN_MODELS, transfer_model
from formation_gnc.control.recovery import RecoveryTrajectory
from formation_gnc.control.riccati import Weights, stationary_gain
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.factorisation import FACTORISATIONS
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import INPUT
from formation_gnc.types import NANOSECONDS, Matrix, Vector


@dataclass(frozen=True)
class SdreParameters(IntegralWeights):
    """Weights, model and its factorisation."""

    model: str = parameter(
        "oblate",
        choices=tuple(PLAN_MODELS),
        in_flight=True,
        doc="nonlinear relative motion to factorise: point-mass gravity, or with J2 (oblate)",
    )
    factorisation: str = parameter(
        "sdc1",
        choices=tuple(FACTORISATIONS),
        in_flight=True,
        doc="state-dependent coefficients of the equations of motion: any chief orbit (sdc1), circular (sdc2)",
    )
    update_interval: float = parameter(
        60.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time between gain updates; 0 updates at every tick",
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "nonlinear"),
        in_flight=True,
        doc="as lqr.feed_forward: acceleration of the target relative to free motion; requires a preview",
    )


class Sdre(Controller[SdreParameters]):
    """LQR with the gain of the factorised equations of motion at the estimate (Joshi 5.1).

    u = -K(x) (x - x_d) - K_I(x) integral + (A(x_d) - A(x)) x_d + feed-forward, with K from the discrete
    Riccati equation of A(x), solved every `update_interval` (5.4)-(5.7). The third term is the remainder of
    (4.13), sign corrected, in the error dynamics of a target in free motion. Without a stabilising gain, an
    LQR on Hill's equations with the same weights is active and the command gives the reason.

    Saturation is handled as by `LinearQuadraticRegulator`. With `integral_error`, an axis at its thrust limit does not
    integrate, and a change of parameters keeps the integral.

    Assumes: matrices that vary little within the closed loop's time constant; the model's assumptions.
    """

    Parameters = SdreParameters

    def __init__(self, parameters: SdreParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Scale the weights and design the fallback law.

        Raises:
            DesignError: inadmissible weights.
        """
        self._parameters = parameters
        self._tick, self._limit, self._mass = common.tick, vehicle.thrust_limit, vehicle.mass
        self._transfer_model = transfer_model(common)
        self._recovery = RecoveryTrajectory(self._transfer_model, common.tick)
        self._chief = common.chief
        self._integrates = parameters.integrates
        self._integral = [0.0, 0.0, 0.0] if self._integrates else []
        self._gain: Matrix | None = None
        self._failure = ""
        self._updated_at: int | None = None
        try:
            self._weights = Weights.scaled(parameters.joint_matrix(), parameters.effort(vehicle), common.tick)
        except DesignError as error:
            raise DesignError(f"sdre: {error}") from error
        self.fallback_law = LinearQuadraticRegulator(LqrParameters(**parameters.weights()), common, vehicle)
        self._feed_forward = FeedForward(parameters.feed_forward, HillModel(common.mean_motion))

    def figures(self) -> dict[str, Any]:
        """The gain on force at zero relative state and the initial chief state."""
        model = PLAN_MODELS[self._parameters.model](Elements(**vars(self._chief)))
        system = state_dependent(model, self._parameters.factorisation, np.zeros(1))
        gain = self.gain(system(np.zeros((1, 6)))[0][0])
        return {"initial gain at the chief [N/m, N/(m/s), N/(m s)]": (self._mass * gain).tolist()}

    def activate(self, handover: Handover) -> None:
        """Take over the integral of a previous SDRE law."""
        self._recovery.end()
        if self._integrates and isinstance(handover.law, Sdre):
            self._integral = handover.law._integral or self._integral

    def gain(self, dynamics: Matrix) -> Matrix:
        """Gain K (3, n) of the discrete LQR for A(x) (6, 6) held over a tick, n = 9 with integral action, else 6.

        Raises:
            DesignError: no stabilising solution.
        """
        inputs = INPUT
        if self._integrates:
            dynamics, inputs = with_integral(dynamics, inputs)
        held = (3, *dynamics.shape)
        phi, gamma = discretise(
            np.broadcast_to(dynamics, held), np.broadcast_to(inputs, (3, *inputs.shape)), self._tick
        )
        return stationary_gain(phi[0], gamma[0], self._weights)

    def _current_gain(self, time: int, dynamics: Matrix) -> Matrix:
        """The gain in force, updated when due; raises DesignError when there is none."""
        since = None if self._updated_at is None else (time - self._updated_at) / NANOSECONDS
        if since is None or not 0.0 <= since < self._parameters.update_interval:
            self._updated_at = time
            try:
                self._gain = self.gain(dynamics)
            except (DesignError, np.linalg.LinAlgError) as failure:
                self._gain, self._failure = None, str(failure)
        if self._gain is None:
            raise DesignError(self._failure)
        return self._gain

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Feedback with the current gain, plus the feed-forward terms."""
        state, goal = estimate.relative_state, target.relative_state
        error = state - goal
        try:
            model = PLAN_MODELS[self._parameters.model](elements_from_state(estimate.chief_state))
            (at_state, at_goal), _ = state_dependent(model, self._parameters.factorisation, np.zeros(2))(
                np.array([state, goal])
            )
            gain = self._current_gain(estimate.time, at_state)
        except (ConfigurationError, ArithmeticError) as reason:
            force = self.fallback_law.command(estimate, target).force
            return Command(force, fallback=f"no gain: {reason}; LQR active")
        feed_forward, unavailable = self._feed_forward(estimate, target)
        integral, remainder = gain[:, 6:] @ np.array(self._integral), ((at_goal - at_state) @ goal)[3:]

        def feedback(off: Vector) -> Vector:
            acceleration: Vector = -gain[:, :6] @ off - integral + remainder + feed_forward
            return acceleration

        time = self._transfer_model.time_at(estimate.chief_state, estimate.time / NANOSECONDS)
        acceleration, off = self._recovery.regulate(error, self._limit / estimate.mass, time, feedback)
        force = estimate.mass * acceleration
        if self._integrates:
            limit = self._limit.tolist()
            self._integral = integrated(self._integral, off[:3].tolist(), force.tolist(), limit, self._tick)
        return Command(force, fallback=unavailable)
