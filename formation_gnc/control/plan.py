"""A reconfiguration to plan, and the thrust history that performs it."""

import math
from dataclasses import dataclass, field

import numpy as np

from formation_gnc.orbit.frames import hill_rate
from formation_gnc.relative.model import RelativeModel
from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class Task:
    """A two-point problem: from a state to a goal in a given time, at least cost.

    The cost is the integral of a' R a over the acceleration, plus e' S^-1 e of the terminal error.
    """

    model: RelativeModel
    """Equations of motion."""
    time: float
    """Start, s, in the model's time."""
    state: Vector
    """(6,) relative state at the start, Hill frame, m and m/s."""
    goal: Vector
    """(6,) relative state to reach at the final time."""
    duration: float
    """Time to go, s."""
    steps: int
    """Number of equal steps over which the thrust is held."""
    guess: Matrix | None = None
    """(steps, 3) initial guess, m/s^2: the remainder of the previous plan, if there is one."""
    effort: Matrix = field(default_factory=lambda: np.eye(3))
    """(3, 3) weight R; infinite on the diagonal of an axis without thrust."""
    slack: Matrix = field(default_factory=lambda: np.zeros((6, 6)))
    """(6, 6) slack S on the terminal state; zero for a hard terminal constraint."""

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return self.duration / self.steps


@dataclass(frozen=True)
class Plan:
    """A thrust history from the time at which it was planned."""

    acceleration: Matrix
    """(N, 3) held over N equal steps in the Hill frame, with which it turns, m/s^2."""
    duration: float
    """Total length of the steps, s."""
    iterations: int = 1
    failure: str = ""
    """Why the plan must not be used; empty for a valid one."""

    @property
    def cost(self) -> float:
        """Integral of the squared acceleration, m^2/s^3."""
        return float(np.sum(self.acceleration**2)) * self.duration / len(self.acceleration)

    def mean(self, begin: Vector | float, end: Vector | float) -> Matrix:
        """Mean acceleration (..., 3) between two times (s) from the plan's start; zero after its end."""
        knots = np.linspace(0.0, self.duration, len(self.acceleration) + 1)
        step = self.duration / len(self.acceleration)
        impulse = np.vstack([np.zeros(3), np.cumsum(self.acceleration, axis=0) * step])
        moved = [np.interp(end, knots, axis) - np.interp(begin, knots, axis) for axis in impulse.T]
        mean: Matrix = np.stack(moved, axis=-1) / np.asarray(np.subtract(end, begin))[..., None]
        return mean


def held_over_tick(acceleration: Vector, chief: Vector, tick: float) -> Vector:
    """The inertially held acceleration (3,), in the Hill axes of the tick's start, with the impulse of a turning one.

    Models and plans hold an acceleration in the Hill frame, which turns about the orbit normal by an angle a over the
    tick (s); the plant holds it in the axes of the start. The mean of the turning one is turned by a / 2, and less by
    the factor sin(a / 2) / (a / 2).

    Args:
        acceleration: (3,) held in the Hill frame, m/s^2.
        chief: (6,) inertial state of the chief at the tick's start, m and m/s.
        tick: length of the tick, s.
    """
    rate, place = hill_rate(chief), chief[:3]
    # The rate w changes by -2 w (r v / r^2) a second, w': the mean angle is w T / 2 + w' T^2 / 6.
    half = 0.5 * rate * tick * (1.0 - 2.0 / 3.0 * float(place @ chief[3:]) / float(place @ place) * tick)
    sine, cosine = math.sin(half), math.cos(half)
    x, y, z = acceleration.tolist()
    share = sine / half if half else 1.0
    return np.array([share * (cosine * x - sine * y), share * (sine * x + cosine * y), z])
