"""Infinite-time state-dependent Riccati equation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.feed_forward import FeedForward
from formation_gnc.control.finite_horizon import PLAN_MODELS
from formation_gnc.control.fixed_endpoint_lq import FACTORISATIONS, discretised, state_dependent
from formation_gnc.control.integral import IntegralWeights, integrated, with_integral
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.riccati import Weights, stationary_gain
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.model import INPUT
from formation_gnc.types import NANOSECONDS, Matrix, Vector


@dataclass(frozen=True)
class SdreParameters(IntegralWeights):
    """Weights, equations of motion and their factorisation."""

    model: str = parameter(
        "oblate",
        choices=tuple(PLAN_MODELS),
        in_flight=True,
        doc="exact relative motion that is factorised: of point masses, or with J2 (oblate)",
    )
    factorisation: str = parameter(
        "sdc1",
        choices=tuple(FACTORISATIONS),
        in_flight=True,
        doc="A(x) x of the equations of motion: about any chief (sdc1) or a circular one (sdc2)",
    )
    update_interval: float = parameter(
        60.0,
        unit="s",
        minimum=0.0,
        in_flight=True,
        doc="time for which one gain is flown; 0 solves at every tick",
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "nonlinear"),
        in_flight=True,
        doc="as lqr.feed_forward: what the target asks beyond free motion; takes a preview of the target",
    )


class Sdre(Controller):
    """LQR whose gain is that of the equations of motion as they are at the estimate (Joshi 5.1).

    u = -K(x) (x - x_d) - K_I(x) integral + (A(x_d) - A(x)) x_d + feed-forward, with K from the discrete
    Riccati equation of A(x), solved again and again (5.4)-(5.7). With x' = A(x) x and a target in free flight
    the third term is what (4.13) leaves of the error's equation, in the sign that helps. A gain that does not
    exist is named, and LQR on Hill's equations flies, on the same weights.

    With `integral_error`, an axis at its thrust limit does not integrate, and a change of parameters keeps
    the integral.

    Assumes: what the model assumes; matrices that change little within the loop's time constant.
    """

    Parameters = SdreParameters

    def __init__(self, parameters: SdreParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Scale the weights and design the law in reserve.

        Raises:
            DesignError: inadmissible weights.
        """
        self._parameters = parameters
        self._tick, self._limit, self._mass = common.tick, vehicle.thrust_limit.tolist(), vehicle.mass
        self._chief = common.chief
        self._integrates = parameters.integrates
        self._integral = [0.0, 0.0, 0.0] if self._integrates else []
        self._gain: Matrix | DesignError = DesignError("none yet")
        self._updated_at: int | None = None
        try:
            r = vehicle.mass**2 * parameters.thrust_matrix()
            self._weights = Weights.scaled(parameters.joint_matrix(), r, common.tick)
        except DesignError as error:
            raise DesignError(f"sdre: {error}") from error
        self.reserve = LinearQuadraticRegulator(LqrParameters(**parameters.weights()), common, vehicle)
        self._feed_forward = FeedForward(parameters.feed_forward, HillModel(common.mean_motion))

    def figures(self) -> dict[str, Any]:
        """The gain on force for a deputy at the chief, where the chief is at the start."""
        model = PLAN_MODELS[self._parameters.model](Elements(**vars(self._chief)))
        system = state_dependent(model, self._parameters.factorisation, np.zeros(1))
        gain = self.gain(system(np.zeros((1, 6)))[0][0])
        return {"gain at the chief, at the start [N/m, N/(m/s), N/(m s)]": (self._mass * gain).tolist()}

    def activate(self, handover: Handover) -> None:
        """Keep the integral of an SDRE that flew before."""
        if self._integrates and isinstance(handover.law, Sdre):
            self._integral = handover.law._integral or self._integral

    def gain(self, dynamics: Matrix) -> Matrix:
        """Gain K (3, n) of the discrete LQR for A(x) (6, 6) held, with the integral of position if any.

        Raises:
            DesignError: no stabilising solution.
        """
        inputs = INPUT
        if self._integrates:
            dynamics, inputs = with_integral(dynamics, inputs)
        held = (3, *dynamics.shape)
        phi, gamma = discretised(
            np.broadcast_to(dynamics, held), np.broadcast_to(inputs, (3, *inputs.shape)), self._tick
        )
        return stationary_gain(phi[0], gamma[0], self._weights)

    def _update(self, time: int, dynamics: Matrix) -> Matrix:
        """The gain in force, solved anew when it is time."""
        since = None if self._updated_at is None else (time - self._updated_at) / NANOSECONDS
        if since is None or not 0.0 <= since < self._parameters.update_interval:
            self._updated_at = time
            try:
                self._gain = self.gain(dynamics)
            except (DesignError, np.linalg.LinAlgError) as failure:
                self._gain = DesignError(str(failure))
        if isinstance(self._gain, DesignError):
            raise self._gain
        return self._gain

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force that the gain of now asks for against the estimated error, and what the target needs."""
        state, goal = estimate.relative_state, target.relative_state
        error = state - goal
        try:
            model = PLAN_MODELS[self._parameters.model](elements_from_state(estimate.chief_state))
            (here, there), _ = state_dependent(model, self._parameters.factorisation, np.zeros(2))(
                np.array([state, goal])
            )
            gain = self._update(estimate.time, here)
        except (ConfigurationError, ArithmeticError) as reason:
            reserve = self.reserve.command(estimate, target)
            return Command(reserve.force, fallback=f"no gain: {reason}; LQR flies")
        acceleration: Vector = -gain[:, :6] @ error - gain[:, 6:] @ np.array(self._integral)
        wanted, reason_of_none = self._feed_forward(estimate, target)
        force = estimate.mass * (acceleration + ((there - here) @ goal)[3:] + wanted)
        if self._integrates:
            self._integral = integrated(self._integral, error[:3].tolist(), force.tolist(), self._limit, self._tick)
        return Command(force, fallback=reason_of_none)
