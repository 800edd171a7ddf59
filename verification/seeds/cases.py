"""What Joshi's cases have in common: units, chiefs, desired trajectories and the flight through them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.nonlinear import NonlinearModel

Array = NDArray[np.float64]

KM = 1e3
MU = 398601e9
"""m^3/s^2, as printed."""
SEMI_MAJOR_AXIS = 10_000.0 * KM
TRUE_ANOMALY = math.radians(10.0)
TICK = 1.0
STATES = ("x", "x'", "y", "y'", "z", "z'")
"""Joshi's order; `in_joshis_order` gives it."""


def chief(eccentricity: float, inclination: float = 0.0) -> KeplerChief:
    """The chief of Tables 4.1, 5.2, 6.2 and 6.6."""
    return KeplerChief(SEMI_MAJOR_AXIS, eccentricity, inclination, true_anomaly=TRUE_ANOMALY, mu=MU)


def model(eccentricity: float, inclination: float = 0.0) -> NonlinearModel:
    """The plant without J2."""
    return NonlinearModel(chief(eccentricity, inclination))


@dataclass(frozen=True)
class Orbit:
    """A line of a table of initial and final relative orbits; a, b and n are zero in all of them."""

    rho: float
    """km."""
    theta: float
    """deg."""
    slope: float
    """m."""

    def state(self, time: float, semi_major_axis: float = SEMI_MAJOR_AXIS) -> Array:
        """(6,) desired state at a time, SI: (4.14)-(4.19) at sqrt(mu / a^3), with the omega that (4.17)
        lacks."""
        constants = RelativeOrbitParameters(rho=self.rho * KM, theta=math.radians(self.theta), m=self.slope)
        orbit = RelativeOrbit(constants, math.sqrt(MU / semi_major_axis**3))
        return np.asarray(orbit.states(np.array([time]))[0])


def in_joshis_order(state: Array) -> Array:
    """[x, x', y, y', z, z'] in km and km/s of an SI state."""
    return np.asarray(state)[[0, 3, 1, 4, 2, 5]] / KM


def fly(
    plant: RelativeModel,
    start: Array,
    thrust: Callable[[float, Array], Array],
    ticks: int,
    tick: float = TICK,
    begin: float = 0.0,
) -> tuple[Array, Array]:
    """States (N + 1, 6) and accelerations (N, 3) of a flight with thrust held over each tick.

    Runge-Kutta of order four: at ticks of a second its error is rounding error.
    """
    states, accelerations = np.empty((ticks + 1, 6)), np.empty((ticks, 3))
    states[0] = start
    for index in range(ticks):
        time, state = begin + index * tick, states[index]
        u = accelerations[index] = thrust(time, state)
        one = plant.derivative(time, state, u)
        two = plant.derivative(time + 0.5 * tick, state + 0.5 * tick * one, u)
        three = plant.derivative(time + 0.5 * tick, state + 0.5 * tick * two, u)
        four = plant.derivative(time + tick, state + tick * three, u)
        states[index + 1] = state + tick / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return states, accelerations


def effort(accelerations: Array, tick: float = TICK) -> float:
    """Integral of the squared acceleration, m^2/s^3."""
    return float(np.sum(accelerations**2)) * tick


def table(heading: Sequence[str], columns: Sequence[Array | Sequence[str]]) -> str:
    """Markdown of state errors: a row for each of `STATES`, a column of six figures or words each."""
    lines = ["| error, km, km/s | " + " | ".join(heading) + " |", "|---" * (len(heading) + 1) + "|"]
    for row, name in enumerate(STATES):
        words = [
            value if isinstance(value, str) else f"{value:.3g}"
            for value in (column[row] for column in columns)
        ]
        lines.append(f"| {name} | " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"
