"""What Joshi's cases have in common: units, chiefs, desired trajectories and the flight through them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from formation_gnc.guidance.relative_orbit import RelativeOrbit, RelativeOrbitParameters
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.nonlinear import NonlinearModel
from verification.figure import save

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
        words = [value if isinstance(value, str) else f"{value:.3g}" for value in (column[row] for column in columns)]
        lines.append(f"| {name} | " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"


def picture(path: Path, what: str, flights: Mapping[str, tuple[Array, Array]], goals: Array) -> None:
    """Trajectories, errors against the desired states (N + 1, 6), and thrust by axis, as in Joshi's figures.

    Lines grow thinner from one flight to the next, so that those below show where they agree. Thrust is drawn
    as far as half of the laws go.
    """
    plot = plt.figure(figsize=(13, 8))
    space = plot.add_subplot(2, 3, 1, projection="3d", elev=30.0, azim=-150.0)
    place, velocity, *axes = (plot.add_subplot(2, 3, k) for k in range(2, 7))
    seconds = TICK * np.arange(len(goals))
    widths = np.linspace(3.0, 1.2, len(flights))
    for width, (name, (states, accelerations)) in zip(widths, flights.items(), strict=True):
        error = states - goals
        space.plot(*(states[:, :3] / KM).T, lw=width, label=name)
        place.semilogy(seconds, np.linalg.norm(error[:, :3], axis=1), lw=width)
        velocity.semilogy(seconds, np.linalg.norm(error[:, 3:], axis=1), lw=width)
        for panel, along in zip(axes, accelerations.T, strict=True):
            panel.plot(seconds[:-1], along, lw=width)
    space.plot(*(goals[:, :3] / KM).T, "k:", lw=1.0, label="desired")
    space.plot(*(goals[-1:, :3] / KM).T, "ko", ms=4, label="desired at the end")
    space.set(xlabel="x, km", ylabel="y, km", title=what)
    space.zaxis.set_rotate_label(False)  # it would stand on its head
    space.set_zlabel("z, km", rotation=90.0)
    place.set(xlabel="time, s", ylabel="position error, m", title="distance from $X_d(t)$")
    velocity.set(xlabel="time, s", ylabel="velocity error, m/s", title="velocity against $X_d(t)$")
    place.set_ylim(bottom=max(1e-3, place.get_ylim()[0]))
    velocity.set_ylim(bottom=max(1e-6, velocity.get_ylim()[0]))
    place.legend(*space.get_legend_handles_labels(), fontsize=8)
    largest = np.array([np.abs(accelerations).max(axis=0) for _, accelerations in flights.values()])
    for name, panel, peaks in zip("xyz", axes, largest.T, strict=True):
        low, high = panel.get_ylim()
        reach = 1.4 * float(np.median(peaks))
        panel.set_ylim(max(low, -reach), min(high, reach))
        panel.set(xlabel="time, s", ylabel="m/s²", title=f"thrust along {name}, at most {peaks.max():.2g} m/s²")
    save(plot, path)
