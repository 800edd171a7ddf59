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
from formation_gnc.types import NANOSECONDS, Matrix

STRETCHES = 180
"""Stretches of an orbit (2 degrees each) over which a time-varying model is taken as constant in the
design."""

MOST_STEPS = 50_000
"""Ticks of the longest finite horizon: a few seconds of design."""


@dataclass(frozen=True)
class LqrParameters(IntegralWeights):
    """Weights, model, and which gain."""

    model: str = parameter(
        "hill",
        choices=tuple(DESIGN_MODELS),
        in_flight=True,
        doc="relative motion that the gain is designed on",
    )
    gain: str = parameter(
        "discrete",
        choices=("discrete", "continuous", "frozen", "periodic", "finite"),
        in_flight=True,
        doc="discrete or continuous: one gain for ever; frozen: that of the model as it is at each point of "
        "the orbit (Roberts); periodic: optimal over all orbits; finite: up to final_time, then as discrete",
    )
    final_time: float = parameter(
        0.0, unit="s", minimum=0.0, in_flight=True, doc="horizon of the finite gain, from where it takes over"
    )
    terminal_weight: float = parameter(
        1.0, minimum=0.0, in_flight=True, doc="state weight at the final time over that of one tick"
    )
    feed_forward: str = parameter(
        "none",
        choices=("none", "linear", "nonlinear"),
        in_flight=True,
        doc="what the target asks beyond free motion: none, by the model above, or by the exact one with J2; "
        "takes a preview of the target",
    )


class LinearQuadraticRegulator(Controller):
    """LQR on a linear relative-motion model.

    Tracks the target: u = -K (x - x_target) + feed-forward, with K from a Riccati equation (Neokleous
    4.29-4.30, sign of 4.33 corrected; Roberts 38-40) for a model discretised exactly with thrust held over a
    tick. A gain that varies along the orbit is tabulated when it is designed and interpolated in flight.

    With `integral_error`, the integral of the position error is a seventh to ninth state; an axis at its
    thrust limit does not integrate, and a change of parameters keeps the integral.

    Assumes: separation much smaller than the chief's radius; what the model assumes.
    """

    Parameters = LqrParameters

    def __init__(self, parameters: LqrParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Solve for the gains.

        Raises:
            DesignError: inadmissible weights, a gain that the model does not have, or no stabilising
            solution.
        """
        model = DESIGN_MODELS[parameters.model](common)
        self.tick = common.tick
        self._limit, self._mass = vehicle.thrust_limit.tolist(), vehicle.mass
        self._integrates = parameters.integrates
        self._feed_forward = FeedForward(parameters.feed_forward, model)
        self._integral = [0.0, 0.0, 0.0] if self._integrates else []
        self._start: int | None = None
        try:
            thrust_weight = vehicle.mass**2 * parameters.thrust_matrix()
            self._design(parameters, model, Weights.scaled(parameters.joint_matrix(), thrust_weight, self.tick))
        except DesignError as error:
            raise DesignError(f"lqr: {error}") from error

    def _design(self, parameters: LqrParameters, model: RelativeModel, weights: Weights) -> None:
        """Set `gain` (3, n), or the table `gains` (N, 3, n) at intervals of `interval` s."""
        tick = self.tick
        self.gain: Matrix
        self.gains: Matrix = np.empty((0, 3, 6))
        self.interval = tick
        self._finite = parameters.gain == "finite"
        if not model.is_time_invariant:
            if parameters.gain not in ("frozen", "periodic"):
                raise DesignError(
                    f"the model {parameters.model} varies along the orbit; "
                    f"gain must be frozen or periodic, not {parameters.gain}"
                )
            self.interval = model.period / STRETCHES
            middles = self.interval * (np.arange(STRETCHES) + 0.5)
            models = [self._discretise(model, float(middle)) for middle in middles]
            if parameters.gain == "frozen":
                self.gains = np.array([stationary_gain(phi, gamma, weights) for phi, gamma in models])
            else:
                self.gains = periodic_gains(models, max(1, round(self.interval / tick)), weights)
            self.gain = self.gains.mean(axis=0)
        elif parameters.gain == "continuous":
            matrices = model.dynamics(0.0), model.INPUT
            self.gain = continuous_gain(*(with_integral(*matrices) if self._integrates else matrices), weights)
        else:
            phi, gamma = self._discretise(model, 0.0)
            self.gain = stationary_gain(phi, gamma, weights)
            if self._finite:
                steps = round(parameters.final_time / tick)
                if not 1 <= steps <= MOST_STEPS:
                    allowed = f"it must be 1 to {MOST_STEPS} ticks of {tick} s"
                    raise DesignError(f"final_time is {parameters.final_time} s; {allowed}")
                terminal = np.zeros((len(phi), len(phi)))
                terminal[:6, :6] = parameters.terminal_weight * parameters.state_matrix()
                self.gains = finite_gains(phi, gamma, weights, terminal, steps)

    def _discretise(self, model: RelativeModel, time: float) -> tuple[Matrix, Matrix]:
        matrices = model.discretise(time, self.tick)
        return with_integral(*matrices, np.eye(3), self.tick) if self._integrates else matrices

    def gain_at(self, time: int) -> Matrix:
        """Gain K (3, n) in force at a time of the run (ns): acceleration per m, m/s and m s of error."""
        if not len(self.gains):
            return self.gain
        if self._finite:
            step = (time - (time if self._start is None else self._start)) // round(self.tick * NANOSECONDS)
            return np.asarray(self.gains[step]) if step < len(self.gains) else self.gain
        place = time / NANOSECONDS / self.interval - 0.5
        index = int(np.floor(place))
        share, size = place - index, len(self.gains)
        gain: Matrix = (1.0 - share) * self.gains[index % size] + share * self.gains[(index + 1) % size]
        return gain

    def figures(self) -> dict[str, Any]:
        """The gain on force, or the mean of those along the orbit."""
        return {
            "gain [N/m, N/(m/s), N/(m s)]": (self._mass * self.gain).tolist(),
            "gains along the orbit": len(self.gains),
        }

    def linear(self, time: int) -> LinearController:
        """The gain of a time, after the horizon of a finite one."""
        gain = self.gain if self._finite else self.gain_at(time)
        integral = np.eye(gain.shape[1] - 6)
        inputs = self.tick * np.eye(len(integral), 6)
        return LinearController(integral, inputs, -gain[:, 6:], -gain[:, :6])

    def activate(self, handover: Handover) -> None:
        """Keep the integral of an LQR that flew before."""
        if self._integrates and isinstance(handover.law, LinearQuadraticRegulator):
            self._integral = handover.law._integral or self._integral

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """The force that the gain asks for against the estimated error, and what the target needs."""
        if self._start is None:
            self._start = estimate.time
        error: list[float] = (estimate.relative_state - target.relative_state).tolist()
        wanted, reason = self._feed_forward(estimate, target)
        force = [
            estimate.mass * (given - sumprod(row, error + self._integral))
            for row, given in zip(self.gain_at(estimate.time).tolist(), wanted.tolist(), strict=True)
        ]
        if self._integrates:
            self._integral = integrated(self._integral, error[:3], force, self._limit, self.tick)
        return Command(np.array(force), fallback=reason)
