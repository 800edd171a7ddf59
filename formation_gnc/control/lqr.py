"""Linear quadratic regulator."""

from dataclasses import dataclass
from math import sumprod
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Handover, Vehicle
from formation_gnc.control.feed_forward import FeedForward
from formation_gnc.control.integral import IntegralWeights, integrated, with_integral
from formation_gnc.control.linear import LinearController
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.recovery import RecoveryTrajectory
from formation_gnc.control.riccati import (
    Weights,
    continuous_gain,
    finite_gains,
    periodic_gains,
    stationary_gain,
)
from formation_gnc.errors import DesignError
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.model import RelativeModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

ORBIT_INTERVALS = 180
"""Intervals of an orbit (2 degrees each) over which the design holds a time-varying model constant."""

MAX_STEPS = 50_000
"""Ticks of the longest finite horizon: a few seconds of design time."""


@dataclass(frozen=True)
class LqrParameters(IntegralWeights):
    """Weights, model and kind of gain."""

    model: str = parameter(
        "hill",
        choices=tuple(DESIGN_MODELS),
        in_flight=True,
        doc="relative-motion model of the design",
    )
    gain: str = parameter(
        "discrete",
        choices=("discrete", "continuous", "frozen", "periodic", "finite"),
        in_flight=True,
        doc="discrete or continuous: constant gain; frozen: infinite-horizon gain of the model frozen at each point "
        "of the orbit (Roberts); periodic: optimal over all orbits; finite: up to final_time, then as discrete",
    )
    final_time: float = parameter(
        0.0, unit="s", minimum=0.0, in_flight=True, doc="horizon of the finite gain, from activation"
    )
    terminal_weight: float = parameter(
        1.0, minimum=0.0, in_flight=True, doc="terminal state weight relative to that of one tick"
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "linear", "nonlinear"),
        in_flight=True,
        doc="acceleration of the target relative to free motion: none, of the design model, or exact with J2; "
        "requires a preview of the target",
    )


class LinearQuadraticRegulator(Controller[LqrParameters]):
    """LQR on a linear relative-motion model.

    Tracks the target: u = -K (x - x_target) + feed-forward, with K from a Riccati equation (Neokleous
    4.29-4.30, sign of 4.33 corrected; Roberts 38-40) for the model discretised exactly with thrust held over a
    tick. A gain that varies along the orbit is tabulated in the design and interpolated in flight, at the phase of
    the estimated chief.

    Where the demand is beyond what clipping leaves stable, the law acts about a trajectory to the target that the
    thrusters can fly (`RecoveryTrajectory`), from any error.

    With `integral_error`, the state is augmented by the integral of the position error: an axis at its thrust
    limit does not integrate, and a change of parameters keeps the integral.

    Assumes: separation much smaller than the chief's radius; the model's assumptions.
    """

    Parameters = LqrParameters

    def __init__(self, parameters: LqrParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Solve for the gains.

        Raises:
            DesignError: inadmissible weights, a kind of gain that does not suit the model, or no stabilising
                solution.
        """
        model = self._model = DESIGN_MODELS[parameters.model](common)
        self.tick = common.tick
        self._limit, self._mass = vehicle.thrust_limit, vehicle.mass
        self._limit_of_mass = self._mass, self._limit / self._mass
        self._recovery = RecoveryTrajectory(model, common.tick)
        self._integrates = parameters.integrates
        self._feed_forward = FeedForward(parameters.feed_forward, model)
        self._integral = [0.0, 0.0, 0.0] if self._integrates else []
        self._start: int | None = None
        self._finite = parameters.gain == "finite"
        self.gain: Matrix
        """(3, n) the gain; the mean over the orbit if it varies, the infinite-horizon one if it is finite."""
        self.gains: Matrix = np.empty((0, 3, 6))
        """(N, 3, n) the gains of a finite horizon or along the orbit, `interval` s apart."""
        self.interval = self.tick
        try:
            weights = Weights.scaled(parameters.joint_matrix(), parameters.effort(vehicle), self.tick)
            if model.is_time_invariant:
                self._design_time_invariant(parameters, model, weights)
            else:
                self._design_along_orbit(parameters, model, weights)
        except DesignError as error:
            raise DesignError(f"lqr: {error}") from error
        self._rows = None if len(self.gains) else self.gain.tolist()
        """Rows of a constant gain."""

    def _design_time_invariant(self, parameters: LqrParameters, model: RelativeModel, weights: Weights) -> None:
        if parameters.gain == "continuous":
            matrices = model.dynamics(0.0), model.INPUT
            self.gain = continuous_gain(*(with_integral(*matrices) if self._integrates else matrices), weights)
            return
        phi, gamma = self._discretise(model, 0.0)
        self.gain = stationary_gain(phi, gamma, weights)
        if self._finite:
            steps = round(parameters.final_time / self.tick)
            if not 1 <= steps <= MAX_STEPS:
                allowed = f"it must be 1 to {MAX_STEPS} ticks of {self.tick} s"
                raise DesignError(f"final_time is {parameters.final_time} s; {allowed}")
            terminal = np.zeros((len(phi), len(phi)))
            terminal[:6, :6] = parameters.terminal_weight * parameters.state_matrix()
            self.gains = finite_gains(phi, gamma, weights, terminal, steps)

    def _design_along_orbit(self, parameters: LqrParameters, model: RelativeModel, weights: Weights) -> None:
        if parameters.gain not in ("frozen", "periodic"):
            raise DesignError(
                f"the model {parameters.model} varies along the orbit; "
                f"gain must be frozen or periodic, not {parameters.gain}"
            )
        self.interval = model.period / ORBIT_INTERVALS
        middles = self.interval * (np.arange(ORBIT_INTERVALS) + 0.5)
        models = [self._discretise(model, float(middle)) for middle in middles]
        if parameters.gain == "frozen":
            self.gains = np.array([stationary_gain(phi, gamma, weights) for phi, gamma in models])
        else:
            self.gains = periodic_gains(models, max(1, round(self.interval / self.tick)), weights)
        self.gain = self.gains.mean(axis=0)

    def _discretise(self, model: RelativeModel, time: float) -> tuple[Matrix, Matrix]:
        matrices = model.discretise(time, self.tick)
        return with_integral(*matrices, np.eye(3), self.tick) if self._integrates else matrices

    def gain_at(self, time: int) -> Matrix:
        """Gain K (3, n) at a time of the run, or of the model (ns): acceleration per m, m/s and m s of error."""
        if not len(self.gains):
            return self.gain
        if self._finite:
            step = (time - (time if self._start is None else self._start)) // round(self.tick * NANOSECONDS)
            return np.asarray(self.gains[step]) if step < len(self.gains) else self.gain
        position = time / NANOSECONDS / self.interval - 0.5
        index = int(np.floor(position))
        fraction, size = position - index, len(self.gains)
        gain: Matrix = (1.0 - fraction) * self.gains[index % size] + fraction * self.gains[(index + 1) % size]
        return gain

    def figures(self) -> dict[str, Any]:
        """The gain on force, the mean over the orbit if it varies."""
        return {
            "gain [N/m, N/(m/s), N/(m s)]": (self._mass * self.gain).tolist(),
            "gains along the orbit": len(self.gains),
        }

    def linear(self, time: int) -> LinearController:
        """Gain and integrator at a time; a finite gain as after its horizon."""
        gain = self.gain if self._finite else self.gain_at(time)
        integral = np.eye(gain.shape[1] - 6)
        inputs = self.tick * np.eye(len(integral), 6)
        return LinearController(integral, inputs, -gain[:, 6:], -gain[:, :6])

    def activate(self, handover: Handover) -> None:
        """Take over the integral of a previous LQR."""
        self._recovery.end()
        if self._integrates and isinstance(handover.law, LinearQuadraticRegulator):
            self._integral = handover.law._integral or self._integral

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Feedback on the estimated error, plus feed-forward."""
        if self._start is None:
            self._start = estimate.time
        error = estimate.relative_state - target.relative_state
        feed_forward, reason = self._feed_forward(estimate, target)
        time, mass, rows, free = estimate.time, estimate.mass, self._rows, feed_forward.tolist()
        if rows is None:
            if not self._finite:
                time = round(self._model.time_at(estimate.chief_state, time / NANOSECONDS) * NANOSECONDS)
            rows = self.gain_at(time).tolist()
        if self._limit_of_mass[0] != mass:
            self._limit_of_mass = mass, self._limit / mass

        def feedback(off: Vector) -> Vector:
            state = off.tolist() + self._integral
            return np.array([push - sumprod(row, state) for row, push in zip(rows, free)])  # noqa: B905 - three each

        acceleration, off = self._recovery.regulate(error, self._limit_of_mass[1], time / NANOSECONDS, feedback)
        force = mass * acceleration
        if self._integrates:
            self._integral = integrated(
                self._integral, off[:3].tolist(), force.tolist(), self._limit.tolist(), self.tick
            )
        return Command(force, fallback=reason)
