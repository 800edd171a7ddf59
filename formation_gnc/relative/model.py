"""What every relative-motion model can do.

A model describes how a deputy moves relative to a chief: in the chief's Hill frame (x radial outwards, y
along-track, z along the orbit normal), with the relative state [x, y, z, vx, vy, vz] in m and m/s, velocities
as seen in the rotating frame, and accelerations in m/s^2. Times are seconds of the run. A model is a frozen
dataclass of its parameters, and holds nothing that changes.

Guidance, navigation and control see only this interface, so that any of them flies with any model.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

Array = NDArray[np.float64]

INPUT: Array = np.vstack([np.zeros((3, 3)), np.eye(3)])
INPUT.setflags(write=False)
NO_THRUST: Array = np.zeros(3)
NO_THRUST.setflags(write=False)
ON_THE_CHIEF: Array = np.zeros(6)
ON_THE_CHIEF.setflags(write=False)


class RelativeModel(ABC):
    """Motion of a deputy relative to a chief; a subclass's docstring states what it assumes.

    Every model gives `derivative` and `dynamics`; what follows from them is here, by integration to rounding
    error, and a model with a closed form overrides it.
    """

    INPUT: ClassVar[Array] = INPUT
    """(6, 3) matrix B by which an acceleration enters: the same for every model."""

    is_linear: ClassVar[bool]
    """Whether the right-hand side is `dynamics(t) x + B u`; then `state` arguments below have no effect."""

    is_time_invariant: ClassVar[bool] = False
    """Whether `dynamics`, `transition` and `discretise` are the same at any time (and state)."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step (s) over which the integration of this model is exact to rounding error."""

    @abstractmethod
    def derivative(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) rate of change of the relative state (..., 6) under an acceleration (..., 3)."""

    @abstractmethod
    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t): the Jacobian of `derivative` with respect to the state, there."""

    @abstractmethod
    def bounded(self, time: float, state: Array) -> Array:
        """(6,) state with the same position, its velocity changed so that the free motion does not drift.

        Which components change, and what "bounded" means for the model, is stated with each.
        """

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix over `duration` from `time`, along the free motion from `state`."""
        return self.discretise(time, duration, state)[0]

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Exact discrete model x(t + tick) = Phi x(t) + Gamma u under an acceleration u held over the tick.

        Returns Phi (6, 6) and Gamma (6, 3). For a nonlinear model: the derivatives of the state after the
        tick with respect to the state before it and to u, along the free motion from `state`.
        """
        joint = np.zeros((6, 10))
        joint[:, 0] = state
        joint[:, 1:7] = np.eye(6)

        def rate(moment: float, columns: Array) -> Array:
            result = np.empty_like(columns)
            if not self.is_linear:
                result[:, 0] = self.derivative(moment, columns[:, 0])
            result[:, 1:] = self.dynamics(moment, columns[:, 0]) @ columns[:, 1:]
            result[3:, 7:] += np.eye(3)
            return result

        joint = integrate(rate, time, joint, tick, self.longest_step)
        return joint[:, 1:7], joint[:, 7:]

    def propagate(self, time: float, state: Array, duration: float, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) state after `duration` from a state (..., 6) under a held acceleration (..., 3)."""
        shape = np.broadcast_shapes(np.shape(state), (*np.shape(acceleration)[:-1], 6))
        return integrate(
            lambda moment, current: self.derivative(moment, current, acceleration),
            time,
            np.broadcast_to(np.asarray(state, dtype=np.float64), shape),
            duration,
            self.longest_step,
        )


class LinearModel(RelativeModel):
    """A model whose right-hand side is `dynamics(t) x + B u`."""

    is_linear = True

    def derivative(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) rate of change of the relative state (..., 6) under an acceleration (..., 3)."""
        free: Array = np.asarray(state) @ self.dynamics(time).T
        return free + np.asarray(acceleration) @ INPUT.T

    def propagate(self, time: float, state: Array, duration: float, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) state after `duration` from a state (..., 6) under a held acceleration (..., 3)."""
        free, forced = self.discretise(time, duration)
        moved: Array = np.asarray(state) @ free.T
        return moved + np.asarray(acceleration) @ forced.T


def integrate(
    rate: Callable[[float, Array], Array], time: float, value: Array, duration: float, longest_step: float
) -> Array:
    """Value after `duration` (either sign) of d(value)/dt = rate(t, value), in equal steps.

    Dormand and Prince's method of order 8 (the tableau of SciPy's DOP853) with fixed steps: the same call
    gives the same bits, smooth in its arguments; step control would give neither.
    """
    if duration == 0.0:
        return value
    steps = math.ceil(abs(duration) / longest_step)
    step = duration / steps
    stages = np.empty((DOP853.n_stages, *value.shape))
    weights = DOP853.A[: DOP853.n_stages, : DOP853.n_stages] * step
    for index in range(steps):
        start = time + index * step
        stages[0] = rate(start, value)
        for stage in range(1, DOP853.n_stages):
            increment = np.tensordot(weights[stage, :stage], stages[:stage], 1)
            stages[stage] = rate(start + DOP853.C[stage] * step, value + increment)
        value = value + np.tensordot(DOP853.B * step, stages, 1)
    return value
