"""A trajectory to the target that keeps the thrust within its limit, from any error."""

import numpy as np

from formation_gnc.control.riccati import Weights
from formation_gnc.types import Matrix, Vector

RATIO = 2.0**0.5
"""Ratio of the bandwidths of successive regulators."""

SLOWEST = 0.01
"""Bandwidth of the slowest regulator, over the orbital rate."""

NEGLIGIBLE = 1e-4
"""Share of the thrust limit below which the trajectory has ended."""


class RecoveryTrajectory:
    """The part of an error that the thrusters take back in their own time, and the acceleration that does so.

    Of a family of regulators (LQR) with decreasing bandwidth, the fastest acts that never asks for more than the
    limit: the level set of its cost-to-go through the state, which free of disturbances it does not leave, must lie
    within |K r| <= limit. So the trajectory ends at the target from any state, and speeds up on the way (low-gain
    scheduling; Lin and Saberi 1993).
    """

    def __init__(self, phi: Matrix, gamma: Matrix, tick: float, rate: float, fastest: float) -> None:
        """Design for phi (6, 6), gamma (6, 3) of a tick (s), from a bandwidth (rad/s) down to `SLOWEST` times `rate`.

        Raises:
            DesignError: no stabilising gain.
        """
        self._phi, self._gamma = phi, gamma
        position = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        count = max(1, int(np.ceil(np.log(fastest / (SLOWEST * rate)) / np.log(RATIO))))
        gains, levels = [], []
        for bandwidth in fastest * RATIO ** -np.arange(count + 1.0):
            weights = Weights.scaled(position, np.eye(3) / bandwidth**4, tick)
            cost_to_go = weights.map(phi, gamma).stabilising()
            gain = weights.gain(phi, gamma, cost_to_go)
            scaled = gain * weights.state_unit
            # The largest K r of an axis with r' P r = V is the square root of (K P^-1 K') V.
            steepest = np.einsum("ji,ij->j", scaled, np.linalg.solve(cost_to_go, scaled.T))
            unscaled = cost_to_go / np.outer(weights.state_unit, weights.state_unit)
            gains.append(gain)
            levels.append(steepest[:, None, None] * unscaled)
        self._gains, self._levels = np.array(gains), np.array(levels)
        self._acceleration: Vector = np.zeros(3)
        self.state: Vector | None = None
        """(6,) the trajectory now, relative to the target; None when there is none."""

    def begin(self, error: Vector) -> None:
        """Start at an error (6,)."""
        self.state = error.copy()

    def acceleration(self, limit: Vector) -> Vector:
        """(3,) acceleration for this tick, within the limit (3,), m/s^2; zero without a trajectory, and at its end."""
        if self.state is None:
            return np.zeros(3)
        most = np.sqrt(np.einsum("i,njik,k->nj", self.state, self._levels, self.state))
        within = (most <= limit)[:, limit > 0.0].all(axis=1)
        gain = self._gains[int(np.argmax(within)) if within.any() else -1]
        self._acceleration = np.clip(-gain @ self.state, -limit, limit)
        if (np.abs(self._acceleration) <= NEGLIGIBLE * limit).all():
            self.state, self._acceleration = None, np.zeros(3)
        return self._acceleration

    def advance(self) -> None:
        """Move on by a tick under the last acceleration."""
        if self.state is not None:
            self.state = self._phi @ self.state + self._gamma @ self._acceleration
