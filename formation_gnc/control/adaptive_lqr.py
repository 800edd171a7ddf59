"""Adaptive LQR: two neural networks identify and compensate unmodelled dynamics in flight."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.models import transfer_model
from formation_gnc.control.networks import Networks, Regulator, basis_functions
from formation_gnc.control.recovery import RecoveryTrajectory
from formation_gnc.control.riccati import Weights, continuous_cost_to_go
from formation_gnc.control.target_prediction import has_jumped
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.chief import latitude_of
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS, Vector

MAX_WEIGHT = 1e6
"""Network weight that counts as divergence: in the networks' units weights are of order one."""

MIN_TICKS = 5
"""Least ticks per identification time: the continuous update laws are integrated by Euler's method."""

MAX_ECCENTRICITY = 0.2
"""Eccentricity of the chief up to which the regulator about a circular one is close to the optimum: 4.5 % above it at
0.15, 140 % at 0.4, where the networks learn later than the orbit changes."""

MAX_ERROR = 1e12
"""Error (m or m/s) beyond which the networks are not evaluated: it would destroy their weights."""


@dataclass(frozen=True)
class AdaptiveLqrParameters(QuadraticWeights):
    """Weights of the regulator, and adaptation parameters of the networks."""

    identification_time: float = parameter(
        100.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time constant of the identification of unmodelled acceleration; longer averages more noise",
    )
    reach: float = parameter(
        100.0,
        unit="m",
        above=0.0,
        in_flight=True,
        doc="error up to which the networks act; far beyond it the law is LQR alone",
    )
    inertia: float = parameter(
        0.1,
        minimum=0.0,
        in_flight=True,
        doc="weight on changes of the costate network: R1 of Joshi (8.8)",
    )


class AdaptiveLinearQuadraticRegulator(Controller[AdaptiveLqrParameters]):
    """LQR on Hill's equations with an adaptive costate for unmodelled dynamics (Joshi 8).

    u = -R^-1 B' (P e + lambda), with e the error from the target. One network identifies the unmodelled
    acceleration of e: eccentricity, a wrong semi-major axis, J2, drag, and a target that is not in free motion.
    The other approximates lambda. With zero weights the law is LQR.

    lambda is not trained while a thruster saturates, which is handled as by `LinearQuadraticRegulator`. If a weight
    diverges, LQR alone is active from then on and the command gives the reason; likewise for as long as the error is
    beyond `MAX_ERROR`.

    Assumes: a chief of small eccentricity; unmodelled accelerations that vary slowly relative to
    `identification_time`, or periodically with the argument of latitude.
    """

    Parameters = AdaptiveLqrParameters

    def __init__(self, parameters: AdaptiveLqrParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Solve for the regulator.

        Raises:
            DesignError: inadmissible weights, no stabilising solution, an identification time too short for the
                tick, or a chief that is too eccentric.
        """
        if common.chief.eccentricity > MAX_ECCENTRICITY:
            raise DesignError(
                f"adaptive_lqr: the chief's eccentricity is {common.chief.eccentricity:g}; it must be at most "
                f"{MAX_ECCENTRICITY:g}; lqr with the model tschauner_hempel suits any"
            )
        if parameters.identification_time < MIN_TICKS * common.tick:
            raise DesignError(
                f"adaptive_lqr: identification_time is {parameters.identification_time} s; "
                f"it must be at least {MIN_TICKS} ticks of {common.tick} s"
            )
        model, orbit = HillModel(common.mean_motion), common.chief
        self._tick = common.tick
        self._transfer_model = transfer_model(common)
        self._recovery = RecoveryTrajectory(self._transfer_model, common.tick)
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        self._mean_motion, self._latitude = model.mean_motion, orbit.argument_of_perigee + orbit.true_anomaly
        self._radius = orbit.semi_major_axis / parameters.reach
        try:
            weights = Weights.scaled(parameters.state_matrix(), parameters.effort(vehicle), common.tick)
            cost_to_go, _ = continuous_cost_to_go(model.dynamics(0.0), model.INPUT, weights)
        except DesignError as error:
            raise DesignError(f"adaptive_lqr: {error}") from error
        self._rate_unit = math.sqrt(weights.input_unit[0])
        self._state_unit = parameters.reach * weights.state_unit
        self._input_unit = parameters.reach * weights.input_unit
        self.cost_to_go = (
            weights.cost_unit / self._rate_unit * cost_to_go / np.outer(weights.state_unit, weights.state_unit)
        )
        dynamics = weights.step(model.dynamics(0.0), model.INPUT)[0] / self._rate_unit
        self._regulator = Regulator(dynamics, weights.state, weights.input, cost_to_go)
        self.networks = Networks(self._regulator, parameters.identification_time * self._rate_unit, parameters.inertia)
        self._target: Target | None = None
        self._failure = ""

    def figures(self) -> dict[str, Any]:
        """The gain on force at zero weights, and the number of weights."""
        columns = [self._regulator.thrust(error, np.zeros(6)) for error in np.diag(1.0 / self._state_unit)]
        gain = -self._mass * self._input_unit[:, None] * np.transpose(columns)
        networks = (self.networks.model_weights, self.networks.costate_weights)
        return {
            "initial gain [N/m, N/(m/s)]": gain.tolist(),
            "network weights": sum(each.size for each in networks),
        }

    def activate(self, handover: Handover) -> None:
        """Take over the weights of a previous law with the same units."""
        self._recovery.end()
        before = handover.law
        if (
            isinstance(before, AdaptiveLinearQuadraticRegulator)
            and not before._failure
            and (before._state_unit == self._state_unit).all()
        ):
            self.networks.copy_weights(before.networks)

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force of the regulator with the networks, which are updated at every tick."""
        offset, limit = estimate.relative_state - target.relative_state, self._limit / estimate.mass
        reason, none = self._failure, np.zeros(6)
        if not np.abs(offset).max() < MAX_ERROR:
            reason = reason or "adaptive_lqr: error out of range; LQR active"

        def feedback(off: Vector) -> Vector:
            error = off / self._state_unit
            return self._input_unit * (self._regulator.thrust(error, none) if reason else self.networks.thrust(error))

        time = self._transfer_model.time_at(estimate.chief_state, estimate.time / NANOSECONDS)
        acceleration, off = self._recovery.regulate(offset, limit, time, feedback)
        if not reason:
            self._adapt(estimate, target, off / self._state_unit, (acceleration, limit))
            largest = self.networks.largest_weight
            if not (largest <= MAX_WEIGHT and np.isfinite(acceleration).all()):
                reason = f"adaptive_lqr: network weights have diverged to {largest:.3g}; LQR active"
                self._failure, acceleration = reason, feedback(offset)
        self._target = None if reason else target  # none: the observer was not updated
        return Command(estimate.mass * acceleration, fallback=reason)

    def _adapt(self, estimate: NavigationState, target: Target, error: Vector, thrust: tuple[Vector, Vector]) -> None:
        """Update the networks for a scaled error, and an acceleration (3,) demanded with its limit (3,)."""
        networks, tick = self.networks, self._tick * self._rate_unit
        latitude = latitude_of(estimate.chief_state)
        if latitude is None:
            latitude = self._latitude + self._mean_motion * estimate.time / NANOSECONDS
        basis, gradients = basis_functions(estimate.relative_state / self._state_unit, self._radius, latitude)
        if self._target is None or self._recovery.has_begun or has_jumped(self._target, target):
            networks.reset_observer(error)
        networks.identify(error, basis, gradients, tick)
        wanted, limit = thrust
        applied = np.clip(wanted, -limit, limit)
        own = (applied - self._recovery.planned) / self._input_unit
        following = networks.predict(error, basis, own, tick)
        if (applied == wanted)[self._limit > 0.0].all():
            networks.train(error, following, gradients, tick)
