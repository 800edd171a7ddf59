"""Mixed-sensitivity H-infinity synthesis of a position controller (Neokleous ch. 5).

Plant y = G u + d with G from acceleration to relative position. With S = (I + G K)^-1 and T = I - S, the
controller u = -K y bounds the largest singular value of

    [w_P S; w_T T; w_u K S]

by gamma at all frequencies. Internally the unit of time is 1 / `rate`, for coefficients of order one.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import slycot
from scipy.linalg import solve_continuous_are

from formation_gnc.control.linear import LinearController
from formation_gnc.errors import DesignError
from formation_gnc.types import Matrix, Vector

MAX_GAMMA = 1e6
"""Bound on the search for a feasible gamma."""

ACCURACY = 1e-3
"""Relative accuracy of the optimal gamma."""


@dataclass(frozen=True)
class WeightingFunction:
    """A first-order weighting function on each of the three channels: direct + residue / (s + pole)."""

    direct: Vector
    residue: Vector
    pole: Vector

    @classmethod
    def performance(cls, bandwidth: Vector, peak: Vector, steady: Vector) -> "WeightingFunction":
        """w_P = (s / M + w_B) / (s + w_B A), whose inverse bounds S (Neokleous 5.7)."""
        pole = bandwidth * steady
        return cls(1.0 / peak, bandwidth - pole / peak, pole)

    @classmethod
    def uncertainty(cls, time: Vector, low: Vector, high: Vector) -> "WeightingFunction":
        """w_T = (tau s + r_0) / (tau / r_inf s + 1), whose inverse bounds T (Neokleous 5.42)."""
        pole = high / time
        return cls(high, (low - high) * pole, pole)

    def at(self, frequency: Vector) -> Matrix:
        """(N, 3) magnitudes at frequencies (N,), rad/s."""
        return np.abs(self.direct + self.residue / (1j * frequency[:, None] + self.pole))


@dataclass(frozen=True)
class MixedSensitivityProblem:
    """A mixed-sensitivity problem in SI units, per channel (x, y, z of the Hill frame)."""

    dynamics: Matrix
    """(6, 6) continuous system matrix of the relative motion, 1/s."""
    performance: WeightingFunction
    uncertainty: WeightingFunction
    effort: Vector
    """(3,) w_u, position per acceleration, s^2."""
    pole_shift: float
    """Shift e of the plant's poles to the right, off the imaginary axis, 1/s (Neokleous 5.6)."""
    disturbance: float
    """Acceleration disturbance equivalent to a metre of position disturbance, 1/s^2."""

    def synthesise(self, full_information: bool, margin: float) -> tuple[LinearController, float, float]:
        """Controller in SI units, the optimal gamma, and the gamma of the design, (1 + margin) times the optimal.

        At the optimal gamma itself the poles of the central controller are unbounded.

        Raises:
            DesignError: plant poles on the imaginary axis, or no gamma is feasible.
        """
        if not (self.pole_shift > 0.0 or self.disturbance > 0.0):
            raise DesignError("the plant has poles on the imaginary axis; pole_shift or disturbance must be above zero")
        if full_information and not self.disturbance > 0.0:
            raise DesignError("disturbance is 0; it must be above zero for the full-information form")
        solve = self._full_information if full_information else self._output_feedback
        try:
            return solve(margin)
        except (ArithmeticError, ValueError) as error:
            raise DesignError(f"no controller at any gamma for these weights ({error})") from error

    @property
    def rate(self) -> float:
        """Inverse of the scaled problem's unit of time, 1/s."""
        return float((self.performance.residue + self.performance.pole * self.performance.direct).max())

    def _scaled(self) -> tuple[Matrix, Matrix, Matrix, Vector, float]:
        """A (12, 12), B (12, 3), C (6, 12) of the plant with the states of w_P and w_T, w_u (3,) and the disturbance.

        In units of time 1 / rate.
        """
        rate, eye, nil = self.rate, np.eye(3), np.zeros((3, 3))
        unit = np.repeat([1.0, rate], 3)
        a = np.zeros((12, 12))
        a[:6, :6] = self.dynamics * np.outer(1.0 / unit, unit) / rate + self.pole_shift / rate * np.eye(6)
        a[6:9, :3] = a[9:, :3] = eye
        a[6:9, 6:9] = -np.diag(self.performance.pole) / rate
        a[9:, 9:] = -np.diag(self.uncertainty.pole) / rate
        b = np.vstack([nil, eye, nil, nil])
        c = np.block(
            [
                [np.diag(self.performance.direct), nil, np.diag(self.performance.residue) / rate, nil],
                [np.diag(self.uncertainty.direct), nil, nil, np.diag(self.uncertainty.residue) / rate],
            ]
        )
        return a, b, c, self.effort * rate**2, self.disturbance / rate**2

    def _output_feedback(self, margin: float) -> tuple[LinearController, float, float]:
        """Output feedback by SLICOT's SB10FD, gamma by bisection."""
        a, b2, c1, effort, disturbance = self._scaled()
        eye, nil = np.eye(3), np.zeros((3, 3))
        channels = np.vstack([nil, nil, eye, nil])
        b = np.hstack([disturbance * b2, channels, b2])
        c = np.vstack([c1, np.zeros((3, 12)), np.hstack([eye, np.zeros((3, 9))])])
        d = np.zeros((12, 9))
        d[:3, 3:6] = np.diag(self.performance.direct)
        d[6:9, 6:] = np.diag(effort)
        d[9:, 3:6] = eye

        def central(gamma: float) -> LinearController | None:
            try:
                ak, bk, ck, dk, _ = slycot.sb10fd(12, 9, 12, 3, 3, gamma, a, b, c, d)
            except slycot.exceptions.SlycotError:
                return None
            # SB10FD does not check one existence condition, without which its controller does not stabilise.
            loop = np.block([[a + b2 @ dk @ c[9:], b2 @ ck], [bk @ c[9:], ak]])
            stable = np.isfinite(loop).all() and (np.linalg.eigvals(loop).real < 0.0).all()
            return self._unscaled(ak, bk, ck, dk, np.ones(3)) if stable else None

        # Own bisection: SLICOT's search is one call that holds the interpreter lock for a second.
        high = 1.0
        while central(high) is None:
            high *= 2.0
            if high > MAX_GAMMA:
                raise ArithmeticError(f"none up to gamma = {high:.3g}")
        low = 0.0 if high == 1.0 else 0.5 * high
        while high - low > ACCURACY * high:
            middle = 0.5 * (high + low)
            high, low = (high, middle) if central(middle) is None else (middle, low)
        gamma = (1.0 + margin) * high
        controller = central(gamma)
        if controller is None:
            raise ArithmeticError(f"none at gamma = {gamma:.3g}")
        return controller, high, gamma

    def _full_information(self, margin: float) -> tuple[LinearController, float, float]:
        """Central state feedback for an acceleration disturbance."""
        a, b, c, effort, disturbance = self._scaled()
        # Matched disturbance: the game's Riccati equation is that of an LQR with a higher cost of thrust, which
        # is unbounded as gamma approaches the gain from the disturbance to the thrust that cancels it.
        optimal = disturbance * float(effort.max())
        gamma = (1.0 + margin) * optimal
        thrust_weight = effort**2 / (1.0 - (disturbance * effort / gamma) ** 2)
        x = solve_continuous_are(a, b, c.T @ c, np.diag(thrust_weight))
        feedback = -(b.T @ x) / effort[:, None] ** 2
        inputs = np.hstack([np.vstack([np.eye(3), np.eye(3)]), np.zeros((6, 3))])
        controller = self._unscaled(a[6:, 6:], inputs, feedback[:, 6:], feedback[:, :6], np.repeat([1.0, self.rate], 3))
        return controller, optimal, gamma

    def _unscaled(self, a: Matrix, b: Matrix, c: Matrix, d: Matrix, unit: Vector) -> LinearController:
        """The controller in SI units; `unit` is the SI value of one scaled unit of each measured error."""
        rate = self.rate
        return LinearController(a * rate, b / unit * rate, c * rate**2, d / unit * rate**2)

    def singular_values(self, controller: LinearController, frequency: Vector) -> dict[str, Matrix]:
        """Singular values (N, 3) of S, T, KS and T_I = K (I + G K)^-1 G over frequencies (N,), unshifted plant."""
        eye6, measured = np.eye(6), controller.b.shape[1]
        result: dict[str, list[Any]] = {"S": [], "T": [], "KS": [], "T_I": []}
        b = np.vstack([np.zeros((3, 3)), np.eye(3)])
        for w in frequency:
            states = np.linalg.solve(1j * w * eye6 - self.dynamics, b)
            k = -(
                controller.c @ np.linalg.solve(1j * w * np.eye(len(controller.a)) - controller.a, controller.b)
                + controller.d
            )
            if measured == 6:  # a position disturbance disturbs its rate too
                k = k @ np.vstack([np.eye(3), 1j * w * np.eye(3)])
            g = states[:3]
            s = np.linalg.inv(np.eye(3) + g @ k)
            for name, value in (("S", s), ("T", np.eye(3) - s), ("KS", k @ s), ("T_I", k @ s @ g)):
                result[name].append(np.linalg.svd(value, compute_uv=False))
        return {name: np.array(values) for name, values in result.items()}
