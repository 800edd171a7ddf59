"""Inversion of the nonlinear relative dynamics, by which a law chooses the motion of the error itself."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.feed_forward import FeedForward
from formation_gnc.control.models import PLAN_MODELS, transfer_model
from formation_gnc.control.recovery import OVERASKED, RecoveryTrajectory
from formation_gnc.control.riccati import spectral_radius
from formation_gnc.control.weights import require_in_plane
from formation_gnc.errors import ConfigurationError, DesignError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import elements_from_state
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector


@dataclass(frozen=True)
class InversionParameters:
    """Model to invert, and feed-forward."""

    model: str = parameter(
        "oblate",
        choices=tuple(PLAN_MODELS),
        in_flight=True,
        doc="nonlinear relative motion to invert: point-mass gravity, or with J2 (oblate)",
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "nonlinear"),
        in_flight=True,
        doc="as lqr.feed_forward: acceleration of the target relative to free motion; requires a preview",
    )


class InvertingController[P: InversionParameters](Controller[P]):
    """A law that gives the error a chosen acceleration w on the nonlinear equations r'' = f(x, t) + u.

    For a reference in motion under f and u_d, u = f(x_d) - f(x) + u_d + w leaves e'' = w: three double integrators,
    at any distance and eccentricity, up to how f changes within a tick.

    The reference is the target or, where the demand is beyond what clipping leaves stable, a trajectory to the target
    that the thrusters can fly (`RecoveryTrajectory`). Without a chief on an orbit the linear model takes the place of
    f, and the command gives the reason.
    """

    def __init__(self, name: str, parameters: P, common: CommonParameters, vehicle: Vehicle) -> None:
        """Take the models.

        Raises:
            DesignError: no radial or along-track thruster.
        """
        require_in_plane(name, vehicle)
        self._name, self._parameters, self._tick = name, parameters, common.tick
        self._limit, self._can_push = vehicle.thrust_limit, vehicle.thrust_limit > 0.0
        self._model = transfer_model(common)
        self._recovery = RecoveryTrajectory(self._model, common.tick)
        self._feed_forward = FeedForward(parameters.feed_forward, HillModel(common.mean_motion))
        perigee = common.chief.semi_major_axis * (1.0 - common.chief.eccentricity)
        self._fastest = HillModel(float(np.sqrt(MU / perigee**3)))

    @abstractmethod
    def wanted(self, off: Vector) -> Vector:
        """Acceleration w (3,), m/s^2, of an error (6,), m and m/s."""

    def check(self, gain: Matrix, remedy: str) -> None:
        """Require that the sampled loop with w = -gain e is stable, also with the least share that clipping leaves.

        Raises:
            DesignError: it is not, on Hill's equations at the rate of a circle through the perigee.
        """
        phi, gamma = self._fastest.discretise(0.0, self._tick)
        feedback = gain + self._fastest.dynamics(0.0)[3:]
        for share in (1.0, 1.0 / OVERASKED):
            radius = spectral_radius(phi - share * gamma @ feedback)
            if not radius < 1.0:
                raise DesignError(
                    f"{self._name}: the sampled loop with {share:.0%} of its demand is unstable (spectral radius "
                    f"{radius:.6f}); {remedy} must be above {np.sqrt(3.0) * self._fastest.mean_motion:.3g}, "
                    "the square root of three times the chief's rate at perigee, or the tick shorter"
                )

    def activate(self, handover: Handover) -> None:
        """Start without a trajectory."""
        self._recovery.end()

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The inverted dynamics between reference and estimate, with the wanted acceleration and the feed-forward."""
        state = estimate.relative_state
        error = state - target.relative_state
        time = self._model.time_at(estimate.chief_state, estimate.time / NANOSECONDS)
        feed_forward, reason = self._feed_forward(estimate, target)
        try:
            nonlinear = PLAN_MODELS[self._parameters.model](elements_from_state(estimate.chief_state))
        except (ConfigurationError, ArithmeticError) as failure:
            nonlinear, reason = None, f"no nonlinear model: {failure}; linear model active"

        def feedback(off: Vector) -> Vector:
            if nonlinear is None:
                free = -self._model.derivative(time, off)[3:]
            else:
                reference, own = nonlinear.derivative(0.0, np.array([state - off, state]))[:, 3:]
                free = reference - own
            acceleration: Vector = np.where(self._can_push, free + feed_forward + self.wanted(off), 0.0)
            return acceleration

        acceleration, _ = self._recovery.regulate(error, self._limit / estimate.mass, time, feedback)
        return Command(estimate.mass * acceleration, fallback=reason)
