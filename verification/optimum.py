"""The least integral of the squared acceleration that takes a deputy from one state to another: the truth
that laws are measured by.

Independent of the package's relative-motion models: Pontryagin's conditions in the inertial frame, with the
potential of a point mass and J2 written out here, solved by shooting with SciPy's integrator.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from formation_gnc.orbit.constants import EARTH_RADIUS, J2

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Field:
    """Gravity of a point mass, with or without J2."""

    mu: float
    oblate: bool

    def acceleration(self, place: Any) -> Any:
        """(3,) m/s^2 at a place (3,), m, real or complex."""
        square = np.sum(place * place)
        pull = -self.mu / square**1.5 * place
        if self.oblate:
            sine = place[2] ** 2 / square
            shape = place * np.array([1.0 - 5.0 * sine, 1.0 - 5.0 * sine, 3.0 - 5.0 * sine])
            pull = pull - 1.5 * J2 * self.mu * EARTH_RADIUS**2 / square**2.5 * shape
        return pull

    def gradient(self, place: Array) -> Array:
        """(3, 3) of the acceleration, by complex steps: no second formula to get wrong."""
        columns = [self.acceleration(place + 1e-20j * axis).imag / 1e-20 for axis in np.eye(3)]
        return np.array(columns).T


@dataclass(frozen=True)
class Optimum:
    """The solution of the boundary problem."""

    cost: float
    """Integral of the squared acceleration, m^2/s^3."""
    miss: float
    """Distance (m) from the goal that shooting leaves."""
    shots: int
    costate: Array
    """(6,) at the start, SI."""


def free_flight(field: Field, state: Array, duration: float) -> Array:
    """(6,) inertial state after a free flight, s."""
    answer = solve_ivp(
        lambda _, s: np.concatenate([s[3:], field.acceleration(s[:3])]),
        (0.0, duration),
        state,
        method="DOP853",
        rtol=1e-13,
        atol=1e-9,
    )
    return np.asarray(answer.y[:, -1])


def optimum(field: Field, start: Array, goal: Array, duration: float) -> Optimum:
    """Solve for inertial states (6,), m and m/s, and a time, s.

    x'' = g(x) - p_v, p_r' = -G(x)' p_v, p_v' = -p_r; the thrust is -p_v. The start of the costate is found by
    Newton's method with differences, which the near-linear problem answers in a few shots.

    Raises:
        RuntimeError: shooting does not converge.
    """
    unit = np.repeat([1.0, 1.0 / duration], 3)  # of the miss
    scale = np.repeat([duration**-3.0, duration**-2.0], 3)  # of the costate, per metre

    def rate(_: float, s: Array) -> Array:
        force, gradient = field.acceleration(s[:3]), field.gradient(s[:3])
        return np.concatenate([s[3:6], force - s[9:12], -gradient.T @ s[9:12], -s[6:9], [s[9:12] @ s[9:12]]])

    def shoot(costate: Array) -> tuple[Array, float]:
        joint = np.concatenate([start, scale * costate, [0.0]])
        tolerance = np.concatenate([np.full(3, 1e-7), np.full(3, 1e-10), 1e-10 * scale, [1e-16]])
        answer = solve_ivp(rate, (0.0, duration), joint, method="DOP853", rtol=1e-12, atol=tolerance)
        return (answer.y[:6, -1] - goal) / unit, float(answer.y[12, -1])

    costate, probe = np.zeros(6), 100.0
    for shot in range(1, 20):
        miss, cost = shoot(costate)
        if np.linalg.norm(miss) < 1e-4:
            return Optimum(cost, float(np.linalg.norm(miss[:3])), shot, scale * costate)
        response = np.column_stack([(shoot(costate + probe * axis)[0] - miss) / probe for axis in np.eye(6)])
        costate = costate - np.linalg.solve(response, miss)
    raise RuntimeError(f"shooting has not converged: {np.linalg.norm(miss):.3g} m left")
