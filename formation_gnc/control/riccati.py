"""Riccati equations of linear quadratic control, solved by doubling.

One step of the backward recursion maps the cost-to-go P to

    H + A' P (I + G P)^-1 A,   with H = Q and G = B R^-1 B',

and the composition of two such maps has the same form. A thousand equal steps cost ten compositions, an orbit
of unequal steps reduces to one map, and repeated squaring converges quadratically to the stabilising solution
without ordering eigenvalues (structure-preserving doubling algorithm: Chu, Fan, Lin and Wang 2004).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are

from formation_gnc.errors import DesignError
from formation_gnc.types import Matrix, Vector

MAX_DOUBLINGS = 60
"""Doublings without convergence, 2^60 steps, that count as no stabilising solution."""


@dataclass(frozen=True)
class RiccatiMap:
    """The backward recursion over any number of steps, from the cost-to-go at their end to that at their start."""

    transition: Matrix
    """(n, n) A: state transition under the optimal input with zero terminal cost."""
    gramian: Matrix
    """(n, n) G: reachability Gramian, weighted by the inverse of the input's cost."""
    cost: Matrix
    """(n, n) H: cost-to-go at the start with zero terminal cost."""

    @classmethod
    def of_step(cls, phi: Matrix, gamma: Matrix, state_weight: Matrix, input_weight: Matrix) -> "RiccatiMap":
        """One step of x+ = phi x + gamma u with the stage cost x' Q x + u' R u."""
        return cls(phi, gamma @ np.linalg.solve(input_weight, gamma.T), state_weight)

    def then(self, later: "RiccatiMap") -> "RiccatiMap":
        """Composition: these steps, followed by the later ones."""
        size = len(self.cost)
        both = np.linalg.solve(np.eye(size) + self.gramian @ later.cost, np.hstack([self.transition, self.gramian]))
        transition, spread = both[:, :size], both[:, size:]
        gramian = later.gramian + later.transition @ spread @ later.transition.T
        cost = self.cost + self.transition.T @ later.cost @ transition
        return RiccatiMap(later.transition @ transition, 0.5 * (gramian + gramian.T), 0.5 * (cost + cost.T))

    def repeated(self, times: int) -> "RiccatiMap":
        """Composition of these steps with themselves, `times` >= 1 in all."""
        if times == 1:
            return self
        half = self.repeated(times // 2)
        twice = half.then(half)
        return twice.then(self) if times % 2 else twice

    def backward(self, cost_to_go: Matrix) -> Matrix:
        """(n, n) cost-to-go at the start for a cost-to-go at the end."""
        size = len(self.cost)
        result = self.cost + self.transition.T @ cost_to_go @ np.linalg.solve(
            np.eye(size) + self.gramian @ cost_to_go, self.transition
        )
        return 0.5 * (result + result.T)

    def stabilising(self) -> Matrix:
        """(n, n) stabilising fixed point: the cost-to-go of these steps over an infinite horizon.

        Raises:
            DesignError: no stabilising solution: a mode is not stabilisable, or not detectable in the cost.
        """
        power = self
        for _ in range(MAX_DOUBLINGS):
            with np.errstate(all="ignore"):
                try:
                    twice = power.then(power)
                except LinAlgError:
                    break
            if not np.isfinite(twice.cost).all():
                break
            change = np.abs(twice.cost - power.cost).max()
            power = twice
            if change <= 1e-14 * np.abs(twice.cost).max():
                return twice.cost
        raise DesignError("the Riccati equation has no stabilising solution for these weights")


@dataclass(frozen=True)
class Weights:
    """Stage cost x' Q x + u' R u, scaled so that states, inputs and cost are of order one.

    In SI units the coefficients span ten orders of magnitude and the Riccati equation is ill-conditioned. The
    states are scaled by length, length times rate, and length over rate (integral), with the rate close to the
    closed loop's bandwidth.
    """

    state: Matrix
    """(n, n) scaled Q."""
    input: Matrix
    """(m, m) scaled R."""
    state_unit: Vector
    """(n,) SI size of one scaled state."""
    input_unit: Vector
    """(m,) SI size of one scaled input."""
    cost_unit: float
    """SI size of one scaled cost."""

    @classmethod
    def scaled(cls, state_weight: Matrix, input_weight: Matrix, tick: float) -> "Weights":
        """Scale SI weights Q (6, 6), or (9, 9) with the integral of position, and R (3, 3) on acceleration.

        Raises:
            DesignError: Q is not positive semidefinite, or R not positive definite.
        """
        for name, weight, least in (("state", state_weight, 0.0), ("thrust", input_weight, 1e-12)):
            size = np.sqrt(np.maximum(np.diag(weight), 0.0))
            size[size == 0.0] = 1.0
            normal = weight / np.outer(size, size)
            if not np.isfinite(normal).all() or np.abs(normal - normal.T).max() > 1e-9:
                raise DesignError(f"the {name} weight is not a symmetric matrix of finite numbers")
            smallest = np.linalg.eigvalsh(normal).min()
            if smallest < least - 1e-9 * (least == 0.0):
                allowed = "zero or more" if least == 0.0 else "above zero"
                raise DesignError(
                    f"the {name} weight has a normalised eigenvalue of {smallest:.3g}; all must be {allowed}"
                )
        thrust = np.sqrt(np.diag(input_weight))
        position, velocity, integral = (
            np.sqrt(np.diag(state_weight))[index : index + 3].max(initial=0.0) / thrust.min() for index in (0, 3, 6)
        )
        rate = max(position**0.5, velocity, integral ** (1.0 / 3.0))
        if rate == 0.0:
            raise DesignError("the state weight is zero: nothing to control")
        rate = min(rate, 1.0 / tick)
        # Unit of length: one unit of acceleration over rate squared.
        state_unit = np.repeat([1.0, rate, 1.0 / rate], 3)[: len(state_weight)]
        input_unit = np.full(3, rate**2)
        cost = (thrust**2).min() * rate**4
        return cls(
            state_weight * np.outer(state_unit, state_unit) / cost,
            input_weight * np.outer(input_unit, input_unit) / cost,
            state_unit,
            input_unit,
            cost,
        )

    def step(self, phi: Matrix, gamma: Matrix) -> tuple[Matrix, Matrix]:
        """Scaled phi (n, n) and gamma (n, m) from SI ones."""
        return (
            phi * np.outer(1.0 / self.state_unit, self.state_unit),
            gamma * np.outer(1.0 / self.state_unit, self.input_unit),
        )

    def map(self, phi: Matrix, gamma: Matrix) -> RiccatiMap:
        """The Riccati map of one step with SI phi (n, n) and gamma (n, m)."""
        return RiccatiMap.of_step(*self.step(phi, gamma), self.state, self.input)

    def gain(self, phi: Matrix, gamma: Matrix, cost_to_go: Matrix) -> Matrix:
        """(m, n) SI gain K of u = -K x over a step of SI phi and gamma; the cost-to-go (n, n) after it is scaled."""
        scaled_phi, scaled_gamma = self.step(phi, gamma)
        weighted = scaled_gamma.T @ cost_to_go
        gain = np.linalg.solve(self.input + weighted @ scaled_gamma, weighted @ scaled_phi)
        return np.asarray(gain, dtype=np.float64) * np.outer(self.input_unit, 1.0 / self.state_unit)


def stationary_gain(phi: Matrix, gamma: Matrix, weights: Weights) -> Matrix:
    """Gain K (3, n) of the infinite-horizon discrete LQR u = -K x for x+ = phi x + gamma u (Neokleous 4.29-4.30).

    Raises:
        DesignError: no stabilising solution.
    """
    gain = weights.gain(phi, gamma, weights.map(phi, gamma).stabilising())
    if not spectral_radius(phi - gamma @ gain) < 1.0:
        raise DesignError("the closed loop of these weights is not stable")
    return gain


def continuous_gain(dynamics: Matrix, inputs: Matrix, weights: Weights) -> Matrix:
    """Gain K (3, n) of the infinite-horizon continuous LQR for dx/dt = A x + B u (Roberts 38-40).

    Raises:
        DesignError: no stabilising solution.
    """
    p, b = continuous_cost_to_go(dynamics, inputs, weights)
    gain = np.asarray(np.linalg.solve(weights.input, b.T @ p))
    return gain * np.outer(weights.input_unit, 1.0 / weights.state_unit)


def continuous_cost_to_go(dynamics: Matrix, inputs: Matrix, weights: Weights) -> tuple[Matrix, Matrix]:
    """Scaled cost-to-go P (n, n) of `continuous_gain`, and the scaled B (n, 3).

    The unit of time is 1 / rate, with rate^2 = `weights.input_unit`.

    Raises:
        DesignError: no stabilising solution.
    """
    rate = np.sqrt(weights.input_unit[0])
    a, b = (each / rate for each in weights.step(dynamics, inputs))
    try:
        return solve_continuous_are(a, b, weights.state, weights.input), b
    except (LinAlgError, ValueError) as error:
        raise DesignError(f"the Riccati equation has no stabilising solution ({error})") from error


def finite_gains(phi: Matrix, gamma: Matrix, weights: Weights, terminal_weight: Matrix, steps: int) -> Matrix:
    """Gains K (steps, 3, n) of the finite-horizon LQR with terminal cost x' S x (Neokleous 4.21).

    `terminal_weight` is S (n, n) in SI units.
    """
    cost_to_go = terminal_weight * np.outer(weights.state_unit, weights.state_unit) / weights.cost_unit
    one = weights.map(phi, gamma)
    gains = np.empty((steps, 3, len(phi)))
    for step in reversed(range(steps)):
        gains[step] = weights.gain(phi, gamma, cost_to_go)
        cost_to_go = one.backward(cost_to_go)
    return gains


def periodic_gains(models: Sequence[tuple[Matrix, Matrix]], repeats: int, weights: Weights) -> Matrix:
    """Gains K (N, 3, n) of the periodic LQR, from the discrete periodic Riccati equation over one orbit.

    Args:
        models: N pairs phi (n, n), gamma (n, 3) of one tick, at N equal intervals of the orbit.
        repeats: ticks per interval.
        weights: stage cost of a tick.

    Raises:
        DesignError: no stabilising periodic solution.
    """
    ends = np.roll(periodic_cost_to_go(models, repeats, weights), -1, axis=0)
    gains = np.empty((len(models), 3, len(weights.state)))
    monodromy = np.eye(len(weights.state))
    for index, ((phi, gamma), end) in enumerate(zip(models, ends, strict=True)):
        middle = weights.map(phi, gamma).repeated((repeats + 1) // 2).backward(end)
        gains[index] = weights.gain(phi, gamma, middle)
        closed = (phi - gamma @ gains[index]) * np.outer(1.0 / weights.state_unit, weights.state_unit)
        monodromy = np.linalg.matrix_power(closed, repeats) @ monodromy
    if not spectral_radius(monodromy) < 1.0:
        raise DesignError("the closed loop of these weights is not stable over an orbit")
    return gains


def periodic_cost_to_go(models: Sequence[tuple[Matrix, Matrix]], repeats: int, weights: Weights) -> Matrix:
    """Scaled cost-to-go P (N, n, n) at the start of each of N intervals of an orbit; arguments as `periodic_gains`."""
    intervals = [weights.map(phi, gamma).repeated(repeats) for phi, gamma in models]
    result = np.empty((len(models), *weights.state.shape))
    cost_to_go = reduce(RiccatiMap.then, intervals).stabilising()
    for index in reversed(range(len(models))):
        result[index] = cost_to_go = intervals[index].backward(cost_to_go)
    return result


def spectral_radius(matrix: Matrix) -> float:
    """Largest magnitude of an eigenvalue."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())
