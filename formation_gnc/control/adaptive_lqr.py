"""LQR with two networks that learn in flight what its model leaves out."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.finite_horizon import leaps
from formation_gnc.control.networks import Networks, Regulator, functions
from formation_gnc.control.riccati import Weights, continuous_cost_to_go
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS, Vector

LARGEST_WEIGHT = 1e6
"""Of a network; beyond it the network counts as blown up: its units make weights of order one."""

FEWEST_TICKS = 5
"""Of the identification time: what follows from continuous time is stepped by Euler's method."""

FARTHEST = 1e12
"""Error, m or m/s, that nobody flies, and that would undo what was learnt."""


@dataclass(frozen=True)
class AdaptiveLqrParameters(QuadraticWeights):
    """Weights of the regulator, and pace and reach of the networks."""

    identification_time: float = parameter(
        100.0,
        unit="s",
        above=0.0,
        in_flight=True,
        doc="time in which an acceleration that the model lacks is learnt; longer averages more noise",
    )
    reach: float = parameter(
        100.0,
        unit="m",
        above=0.0,
        in_flight=True,
        doc="error up to which the networks act; LQR flies alone far beyond it",
    )
    inertia: float = parameter(
        0.1,
        minimum=0.0,
        in_flight=True,
        doc="weight on keeping the weights of the costate network: R1 of Joshi (8.8)",
    )


class AdaptiveLinearQuadraticRegulator(Controller):
    """LQR on Hill's equations, and the costate for what they leave out, learnt in flight (Joshi 8).

    u = -R^-1 B' (P e + lambda), with e the error against the target. What Hill's equations leave out of the
    motion of e, one network learns: eccentricity, a wrong semi-major axis, J2, drag, and a target that is no
    free orbit. The other learns lambda. The law starts as LQR.

    While a thruster is at its limit, lambda is not learnt. When a weight blows up, LQR flies alone from then
    on, and the command says so; an error beyond `FARTHEST` is LQR's alone for as long as it is there.

    Assumes: what is left out changes slowly against `identification_time`, or with the chief's revolution.
    """

    Parameters = AdaptiveLqrParameters

    def __init__(self, parameters: AdaptiveLqrParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Solve for the regulator.

        Raises:
            DesignError: inadmissible weights, no stabilising solution, or learning too brisk for the tick.
        """
        if parameters.identification_time < FEWEST_TICKS * common.tick:
            raise DesignError(
                f"adaptive_lqr: identification_time is {parameters.identification_time} s; "
                f"it must be at least {FEWEST_TICKS} ticks of {common.tick} s"
            )
        model, orbit = HillModel(common.mean_motion), common.chief
        self._tick = common.tick
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        self._rate, self._latitude = model.mean_motion, orbit.argument_of_perigee + orbit.true_anomaly
        self._radius = orbit.semi_major_axis / parameters.reach
        try:
            weights = Weights.scaled(
                parameters.state_matrix(), vehicle.mass**2 * parameters.thrust_matrix(), common.tick
            )
            cost_to_go, _ = continuous_cost_to_go(model.dynamics(0.0), model.INPUT, weights)
        except DesignError as error:
            raise DesignError(f"adaptive_lqr: {error}") from error
        self._pace = math.sqrt(weights.input_unit[0])
        self._state_unit = parameters.reach * weights.state_unit
        self._input_unit = parameters.reach * weights.input_unit
        self.cost_to_go = weights.cost_unit / self._pace * cost_to_go / np.outer(weights.state_unit, weights.state_unit)
        dynamics = weights.step(model.dynamics(0.0), model.INPUT)[0] / self._pace
        self._regulator = Regulator(dynamics, weights.state, weights.input, cost_to_go)
        self.networks = Networks(self._regulator, parameters.identification_time * self._pace, parameters.inertia)
        self._target: Target | None = None
        self._failure = ""

    def figures(self) -> dict[str, Any]:
        """The gain on force that the law starts with, and how much it has to learn."""
        columns = [self._regulator.thrust(error, np.zeros(6)) for error in np.diag(1.0 / self._state_unit)]
        gain = -self._mass * self._input_unit[:, None] * np.transpose(columns)
        networks = (self.networks.model_weights, self.networks.costate_weights)
        return {
            "gain at the start [N/m, N/(m/s)]": gain.tolist(),
            "network weights": sum(each.size for each in networks),
        }

    def activate(self, handover: Handover) -> None:
        """Go on with what a law of the same kind and reach has learnt."""
        before = handover.law
        if (
            isinstance(before, AdaptiveLinearQuadraticRegulator)
            and not before._failure
            and (before._state_unit == self._state_unit).all()
        ):
            self.networks.remember(before.networks)

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force of the regulator and the networks, which learn from this tick."""
        offset = estimate.relative_state - target.relative_state
        error, reason = offset / self._state_unit, self._failure
        if not np.abs(offset).max() < FARTHEST:
            reason = reason or "adaptive_lqr: the error is out of any range; LQR flies"
        elif not reason:
            thrust = self._learn(estimate, target, error)
            largest = self.networks.largest_weight
            if not (largest <= LARGEST_WEIGHT and np.isfinite(thrust).all()):
                reason = f"adaptive_lqr: network weights have blown up to {largest:.3g}; LQR flies"
                self._failure = reason
        if reason:
            thrust = self._regulator.thrust(error, np.zeros(6))
        self._target = None if reason else target  # none: the virtual deputy has stayed behind
        return Command(estimate.mass * self._input_unit * thrust, fallback=reason)

    def _learn(self, estimate: NavigationState, target: Target, error: Vector) -> Vector:
        """Scaled thrust, with the networks corrected by what the last one did."""
        networks, tick = self.networks, self._tick * self._pace
        latitude = self._latitude + self._rate * estimate.time / NANOSECONDS
        values, slopes = functions(estimate.relative_state / self._state_unit, self._radius, latitude)
        if self._target is None or leaps(self._target, target):
            networks.meet(error)
        networks.identify(error, values, slopes, tick)
        wanted = networks.thrust(error)
        limit = self._limit / (estimate.mass * self._input_unit)
        flown = np.clip(wanted, -limit, limit)
        following = networks.fly(error, values, flown, tick)
        if (flown == wanted)[self._limit > 0.0].all():
            networks.teach(error, following, slopes, tick)
        return wanted
