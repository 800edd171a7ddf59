"""Low-thrust control of the relative elements by a Lyapunov function and a reference governor."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Command, Controller, Vehicle
from formation_gnc.control.models import near_circular_rates
from formation_gnc.control.plan import held_over_tick
from formation_gnc.parameters import parameter
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.relative_elements import near_circular_elements
from formation_gnc.types import NANOSECONDS

FASTEST = 0.5
"""Largest share of an error that a tick takes back."""

DUTY = 0.2
"""Share of a revolution in which the governor counts on thrust: that of cos^14."""


@dataclass(frozen=True)
class RoeLyapunovParameters:
    """Gain, time and thrust windows."""

    gain: float = parameter(
        3.0,
        above=0.0,
        in_flight=True,
        doc="rate, per n, at which thrust takes back an error in mid-window",
    )
    settling: float = parameter(
        2.0,
        minimum=1.5,
        in_flight=True,
        doc="time allowed for dlambda, in revolutions: three time constants; thrust windows come twice in each",
    )
    window: int = parameter(
        14,
        minimum=0,
        maximum=100,
        in_flight=True,
        doc="exponent N of the thrust windows, |cos|^N about where thrust does most: higher is cheaper and slower",
    )
    off_in_eclipse: bool = parameter(False, in_flight=True, doc="no thrust in the chief's eclipses")
    along_track_only: bool = parameter(False, in_flight=True, doc="thrust along the track only: da, dlambda, dex, dey")


class RoeLyapunov(Controller[RoeLyapunovParameters]):
    """Thrust along and across the track by which a Lyapunov function of the relative elements never grows.

    With the errors [a, l, e, i] of da, dlambda and the two vectors, of which e_1 and i_1 point to the present place in
    the orbit, and the reference a_r of a governor,

        V = (a - a_r)^2 / 2 + |e|^2 / 2 + |i|^2 / 2,
        u_y = -K n / 2 w (a - a_r + e_1),     u_z = -K n |i_1 / i|^N i_1:

    V' = -K w (a - a_r + e_1)^2 - K |i_1/i|^N i_1^2 <= 0 for any weight w >= 0, within the thrust limit and beyond it.
    Weights hold the thrust where it does most: |e_1 / e|^N for the part of e in the error, anywhere for that of a, so
    that a vanishing e leaves no direction to wait for (after Steindorf, D'Amico, Scharnagl, Kempf and Schilling 2017,
    who weight e and i so and take the pseudo-inverse of their input matrix). A
    governor moves dlambda by a_r: in the time allowed, and no faster than the thrusters can stop.

    Assumes: near-circular chief; separation from the target much smaller than the radius; a target in free motion.
    """

    Parameters = RoeLyapunovParameters

    def __init__(self, parameters: RoeLyapunovParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Take the rates of the chief; raises DesignError for an eccentric one, or no thrust along the track."""
        self._parameters, self._tick, self._limit = parameters, common.tick, vehicle.thrust_limit
        self._rate, *_ = near_circular_rates("roe_lyapunov", common, vehicle.thrust_limit)
        self._gain = min(parameters.gain * self._rate, FASTEST / common.tick)
        self._time = parameters.settling * math.tau / self._rate / 3.0

    def figures(self) -> dict[str, Any]:
        """Rate of convergence."""
        return {"time constant in a thrust window [s]": 1.0 / self._gain, "time constant of dlambda [s]": self._time}

    def command(self, estimate: NavigationState, target: Target) -> Command:
        """Feedback on the relative elements, off in eclipse if so configured."""
        own = self._parameters
        if own.off_in_eclipse and self._is_dark(estimate.time, target):
            return Command(np.zeros(3), "eclipse")
        error = estimate.relative_state - target.relative_state
        a, along, ex, ey, ix, iy = near_circular_elements(0.0, self._rate, error).tolist()
        off = a - self._reference(along, estimate.mass)
        along_track = -0.5 * self._gain * self._rate * self._window(ex, ey, off) * (off + ex)
        across = 0.0 if own.along_track_only else -self._gain * self._rate * self._window(ix, iy) * ix
        limit = self._limit / estimate.mass
        acceleration = np.clip([0.0, along_track, across], -limit, limit)
        steady = held_over_tick(acceleration, estimate.chief_state, self._tick)
        cost = 0.5 * (off**2 + ex**2 + ey**2 + ix**2 + iy**2)
        return Command(estimate.mass * np.where(self._limit > 0.0, steady, 0.0), "thrust", cost=cost)

    def _reference(self, along: float, mass: float) -> float:
        """The governor's da (m) for an error in dlambda (m): towards zero, as fast as thrust can still stop it."""
        drift, pull = 1.5 * self._rate, 2.0 / self._rate * DUTY * float(self._limit[1]) / mass
        most = math.sqrt(2.0 * abs(along) * pull / drift)
        return math.copysign(min(abs(along) / (drift * self._time), most), along)

    def _window(self, here: float, aside: float, anywhere: float = 0.0) -> float:
        """Weight of thrust here against an error vector (towards here, a quarter turn on) and one without a place."""
        size = math.hypot(here, aside)
        if not size > 0.0:
            return 1.0
        share = 1.0 / (1.0 + (anywhere / size) ** 2)
        return float(1.0 - share + share * abs(here / size) ** self._parameters.window)

    def _is_dark(self, time: int, target: Target) -> bool:
        """Whether any of the tick is in an eclipse."""
        end = time + round(self._tick * NANOSECONDS)
        return any(begin < end and time < over for begin, over in target.eclipses.tolist())
