"""The least cost that takes a deputy from one orbit to another, in a given time or without one: the truth
that laws are measured by.

Independent of the package's relative-motion models: Pontryagin's conditions in the inertial frame, with the
potential of a point mass and J2 written out here, solved by shooting and by collocation with SciPy.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp, solve_ivp

from formation_gnc.orbit.constants import EARTH_RADIUS, J2

Array = NDArray[np.float64]


def collocated(
    rate: Callable[[Array, Array], Array],
    ends: Callable[[Array, Array], Array],
    times: Array,
    guess: Array,
    tolerance: float,
    at: Array,
) -> Array:
    """States (n, K) at times (K,) of ds/dt = rate(t, s) between two ends, where `ends` is zero.

    Raises RuntimeError when collocation from a guess (n, N) at times (N,) does not get there.
    """
    found = solve_bvp(rate, ends, times, guess, tol=tolerance, max_nodes=20_000)
    if found.status != 0:
        raise RuntimeError(found.message)
    return np.asarray(found.sol(at))


@dataclass(frozen=True)
class Field:
    """Gravity of a point mass, with or without J2."""

    mu: float
    oblate: bool

    def acceleration(self, place: Any) -> Any:
        """(3, ...) m/s^2 at places (3, ...), m, real or complex."""
        square = np.sum(place * place, axis=0)
        pull = -self.mu / square**1.5 * place
        if self.oblate:
            sine = place[2] ** 2 / square
            shape = place * np.array([1.0 - 5.0 * sine, 1.0 - 5.0 * sine, 3.0 - 5.0 * sine])
            pull = pull - 1.5 * J2 * self.mu * EARTH_RADIUS**2 / square**2.5 * shape
        return pull

    def turn(self, place: Array, along: Array) -> Array:
        """(3, ...) gradient at places, which is symmetric, times vectors: a complex step, so that there is no
        second formula to get wrong."""
        return np.asarray(self.acceleration(place + 1e-20j * along).imag / 1e-20)

    def rate(self, _: float, state: Array) -> Array:
        """(6,) rate of change of an inertial state in free flight."""
        return np.concatenate([state[3:], self.acceleration(state[:3])])


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
    answer = solve_ivp(field.rate, (0.0, duration), state, method="DOP853", rtol=1e-13, atol=1e-9)
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
        force, turn = field.acceleration(s[:3]), field.turn(s[:3], s[9:12])
        return np.concatenate([s[3:6], force - s[9:12], -turn, -s[6:9], [s[9:12] @ s[9:12]]])

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


def regulated(field: Field, start: Array, goal: Array, duration: float, tau: float) -> float:
    """The least integral (m^2/s^3) of |u|^2 + |e|^2 / tau^4, e the way from a free flight, with a free end.

    Start and goal are inertial states (6,) at the beginning, duration and tau are s. As above, but with
    p_r' = -G(x)' p_v - e / tau^4 and no costate at the end, for the way itself, in units of tau and of the
    way at the start: by collocation, since what shooting leaves would grow as exp(duration / tau).

    Raises:
        RuntimeError: collocation does not converge.
    """
    flight = solve_ivp(field.rate, (0.0, duration), goal, method="DOP853", rtol=1e-13, atol=1e-9, dense_output=True).sol
    size = float(np.linalg.norm((start - goal)[:3]))
    first = (start - goal) / size * np.repeat([1.0, tau], 3)

    def rate(moment: Array, s: Array) -> Array:
        way, speed, by_place, by_speed = s.reshape(4, 3, -1)
        aim = flight(tau * moment)[:3]
        pull = (field.acceleration(aim + size * way) - field.acceleration(aim)) * tau**2 / size
        turn = field.turn(aim + size * way, by_speed) * tau**2
        return np.concatenate([speed, pull - by_speed, -turn - way, -by_place])

    moments = np.linspace(0.0, duration / tau, 201)
    guess = np.concatenate([np.outer(first, np.exp(-moments)), np.zeros((6, len(moments)))])
    fine = np.linspace(0.0, duration / tau, 20_001)
    path = collocated(rate, lambda begin, end: np.concatenate([begin[:6] - first, end[6:]]), moments, guess, 1e-7, fine)
    return size**2 / tau**3 * float(np.trapezoid(np.sum(path[:3] ** 2 + path[9:] ** 2, axis=0), fine))
