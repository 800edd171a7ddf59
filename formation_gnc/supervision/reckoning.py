"""Dead reckoning: the chief's ephemeris and the estimate against their own propagation."""

from dataclasses import dataclass
from math import ceil, inf

import numpy as np

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_to_first
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.records import Estimate, Measurement
from formation_gnc.supervision.thresholds import standard_deviations
from formation_gnc.types import NANOSECONDS, Vector

TICKS, INTERVAL = 10, 120.0
"""Ticks between comparisons, and the longest time in between, s, of which there is at least a tick."""

WINDOW = 300.0
"""Time over which an ephemeris is propagated before the propagation starts anew, s. Two windows overlap by half."""

LONGEST = 3000.0
"""Time after which it starts anew in any case, also while the ephemeris is off, s."""

NOISE = 1.0
"""Largest error of an ephemeris that is well, m."""

GRAVITY, OTHER = 6e-4, 2e-5
"""Largest acceleration beyond point mass and J2, m/s^2: of gravity, mostly by J22, at the Earth's surface, falling with
the fourth power of the radius (EGM2008 has 3.1e-4 at 490 km); of Sun, Moon and drag."""

STEP = 30.0
"""Longest integration step, s."""


@dataclass(frozen=True, slots=True)
class Reckoning:
    """What comes of propagating from the last comparison to this one."""

    chief: float
    """Largest distance of the ephemeris from its propagation, over what is allowed after a time t: `NOISE` + 1/2 a
    t^2, with the largest unmodelled acceleration a. Infinite for an ephemeris that is no orbit."""
    chief_seconds: float
    """Longest of the propagations, s."""
    jump: tuple[float, ...] | None
    """Estimate less the propagated estimate of the last comparison, (6,), beyond what the unmodelled acceleration may
    differ by between the satellites, in standard deviations of the latter; None without two estimates of one run of the
    filter."""


@dataclass(slots=True)
class _Anchor:
    """A propagated ephemeris."""

    state: Vector
    seconds: float


@dataclass(frozen=True, slots=True)
class _Last:
    """The estimate of the last comparison."""

    chief: Vector
    relative: Vector
    sigmas: list[float]
    """(6,), after the interval."""


class DeadReckoner:
    """Propagates chief and deputy under the point mass with J2 and the applied thrust, from comparison to comparison.

    Thrust enters by its mean over the interval and, to first order, by when it came. What is left is the turn of the
    axes meanwhile: a tenth, over a hundred seconds in low orbit, of what the thrust has moved.
    """

    def __init__(self, tick_ns: int) -> None:
        """Without a memory."""
        self.ticks = min(max(1, round(INTERVAL * NANOSECONDS / tick_ns)), TICKS)
        """Between comparisons."""
        self._tick = tick_ns / NANOSECONDS
        self._seconds = self.ticks * self._tick
        self._propagator = Propagator(self._seconds, ceil(self._seconds / STEP))
        self.reset()

    def reset(self) -> None:
        """Forget everything, after missed ticks."""
        self._clear_thrust()
        self._anchors: list[_Anchor] = []
        self._last: _Last | None = None

    def add_thrust(self, acceleration: list[float], left: int) -> None:
        """Take the acceleration (3,) by thrust over the tick that has ended, Hill frame, m/s^2.

        left: ticks from now to the comparison.
        """
        after = (left + 0.5) * self._tick
        for axis, value in enumerate(acceleration):
            self._speed[axis] += value * self._tick
            self._shift[axis] += value * self._tick * after

    def _clear_thrust(self) -> None:
        self._speed, self._shift = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]

    def compare(self, measurement: Measurement, estimate: Estimate | None, continues: bool) -> Reckoning | None:
        """Compare, and start the next interval; None for the first one.

        Args:
            measurement: with the chief's ephemeris.
            estimate: of the same tick, finite.
            continues: whether its filter has run on since the last comparison.
        """
        ephemeris = measurement.chief_state
        last = self._last if continues and estimate is not None else None
        states = self._propagated(last)
        speed, shift = self._speed, self._shift
        self._clear_thrust()
        self._last = None
        if estimate is not None:
            self._last = _Last(estimate.chief_state, estimate.relative_state, _sigmas(estimate, self._seconds))
        if not self._anchors:
            self._anchors = [_Anchor(ephemeris, 0.0), _Anchor(ephemeris, 0.5 * WINDOW)]
            return None
        if states is None:
            self._anchors = []
            return Reckoning(inf, self._seconds, None)
        jump = None
        if last is not None and estimate is not None:
            difference = (estimate.relative_state - relative_to_first(states[-2:])[0]).tolist()
            for axis in range(3):  # the mean of the thrust is in the propagation
                difference[axis] -= shift[axis] - 0.5 * speed[axis] * self._seconds
            jump = self._in_sigmas(difference, last)
        return Reckoning(*self._compared(ephemeris, states), jump)

    def _propagated(self, last: _Last | None) -> Vector | None:
        """(N, 6) anchors, then chief and deputy of the last estimate, after the interval; None where that fails."""
        rows = [anchor.state for anchor in self._anchors]
        if not rows:
            return None
        accelerations = np.zeros((len(rows) + 2, 3))
        try:
            if last is not None:
                rows += [last.chief, inertial_from_relative(last.chief, last.relative)]
                if any(self._speed):  # along the Hill axes, to inertial ones
                    accelerations[-1] = np.array(self._speed) / self._seconds @ hill_rotation(last.chief)
            states: Vector = self._propagator.propagate(
                0.0, np.array(rows), accelerations[: len(rows)] if last is None else accelerations, np.ones(len(rows))
            )
        except (ImpactError, ConfigurationError):
            return None
        return states

    def _in_sigmas(self, difference: list[float], last: _Last) -> tuple[float, ...]:
        """A difference (6,) beyond the allowance, in standard deviations of the last estimate."""
        radius = _norm(last.chief)
        differential = 4.0 * _unmodelled(radius) * _norm(last.relative) / radius
        allowed = (0.5 * differential * self._seconds**2, differential * self._seconds)
        return tuple(
            max(0.0, abs(each) - allowed[place // 3]) / sigma
            for place, (each, sigma) in enumerate(zip(difference, last.sigmas, strict=True))
        )

    def _compared(self, ephemeris: Vector, states: Vector) -> tuple[float, float]:
        """Ratio and time of the ephemeris against the anchors, which move on."""
        x, y, z = ephemeris[:3].tolist()
        ratio, longest = 0.0, 0.0
        unmodelled = _unmodelled((x * x + y * y + z * z) ** 0.5)
        for anchor, state in zip(self._anchors, states, strict=False):
            rx, ry, rz = state[:3].tolist()
            anchor.state = state
            anchor.seconds += self._seconds
            distance = ((x - rx) ** 2 + (y - ry) ** 2 + (z - rz) ** 2) ** 0.5
            own = distance / (NOISE + 0.5 * unmodelled * anchor.seconds**2)
            if not own < inf:
                own = inf
            ratio, longest = max(ratio, own), max(longest, anchor.seconds)
            if anchor.seconds >= (WINDOW if own < 1.0 else LONGEST) or own == inf:
                anchor.state, anchor.seconds = ephemeris, 0.0
        return ratio, longest


def _norm(state: Vector) -> float:
    x, y, z = state[:3].tolist()
    return float((x * x + y * y + z * z) ** 0.5)


def _unmodelled(radius: float) -> float:
    """Largest acceleration beyond point mass and J2 at a radius (m), m/s^2."""
    return GRAVITY * (EARTH_RADIUS / radius) ** 4 + OTHER if radius > 0.0 else inf


def _sigmas(estimate: Estimate, seconds: float) -> list[float]:
    """Standard deviations (6,) of an estimate after a while: those of the positions grow by those of the rates."""
    sigmas = standard_deviations(estimate.covariance.diagonal().tolist())
    return [sigmas[axis] + seconds * sigmas[3 + axis] for axis in range(3)] + sigmas[3:]
