"""Interface of relative-motion models.

A model describes the motion of a deputy relative to a chief, in the chief's Hill frame (x radial outwards, y
along-track, z along the orbit normal), with the relative state [x, y, z, vx, vy, vz] in m and m/s as defined in
`formation_gnc.orbit.frames`, and accelerations in m/s^2. Times are seconds of the run. A model is a frozen
dataclass of its parameters.

Guidance, navigation and control depend on this interface alone.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.elements import Elements
from formation_gnc.orbit.runge_kutta import COUPLING, INSTANT_OF_STAGE, INSTANTS, STAGES, WEIGHTS

Array = NDArray[np.float64]


def _constant(value: Array) -> Array:
    value.setflags(write=False)
    return value


INPUT = _constant(np.vstack([np.zeros((3, 3)), np.eye(3)]))
NO_THRUST = _constant(np.zeros(3))
ON_THE_CHIEF = _constant(np.zeros(6))


class RelativeModel(ABC):
    """Motion of a deputy relative to a chief; the docstring of a subclass states its assumptions.

    A model defines `about`, `derivative` and `dynamics`. The rest follows by integration to rounding error, and
    is overridden where a closed form exists. The class variables state what the model is capable of: flight
    software chooses from `formation_gnc.relative.registry` by them.
    """

    INPUT: ClassVar[Array] = INPUT
    """(6, 3) input matrix B of an acceleration: the same for every model."""

    is_linear: ClassVar[bool]
    """Whether the right-hand side is `dynamics(t) x + B u`; the `state` arguments below then have no effect."""

    is_time_invariant: ClassVar[bool] = False
    """Whether `dynamics`, `transition` and `discretise` do not depend on time and state."""

    is_periodic: ClassVar[bool] = False
    """Whether `dynamics` repeats after every `period`, as that of a time-invariant model does."""

    has_closed_form: ClassVar[bool] = False
    """Whether `transition` is in closed form, at the same cost for any duration."""

    has_j2: ClassVar[bool] = False
    """Whether the model contains the oblateness of the Earth, averaged or not."""

    is_exact_under_j2: ClassVar[bool] = False
    """Whether the motion is that of two satellites under point mass and J2 without approximation: the same as
    from integrating both in the inertial frame."""

    @classmethod
    @abstractmethod
    def about(cls, chief: Elements) -> Self:
        """The model about a chief with these osculating elements at time zero.

        Raises:
            OrbitError: the model is not valid about this chief.
        """

    @property
    @abstractmethod
    def period(self) -> float:
        """Period of the chief's argument of latitude, s."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step of an integration to rounding error, s."""

    @abstractmethod
    def derivative(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) rate of change of the relative state (..., 6) under an acceleration (..., 3)."""

    @abstractmethod
    def dynamics(self, time: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A(t): the Jacobian of `derivative` with respect to the state, there."""

    def time_at(self, chief: Array, time: float) -> float:
        """Time in the model (s), up to whole periods, at which its chief is where an inertial state (6,) is.

        Perturbations change the period and turn the perigee: whatever repeats with the chief's revolution is in
        phase with the estimated chief at this time, not at that of the clock, which holds for a model without a
        phase and for a state that is on no orbit.
        """
        return time

    def motion(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> tuple[Array, Array]:
        """`derivative` (6,) and `dynamics` (6, 6) at one state."""
        return self.derivative(time, state, acceleration), self.dynamics(time, state)

    def transition(self, time: float, duration: float, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) state transition matrix over `duration` from `time`, along the free motion from `state`."""
        return self.discretise(time, duration, state)[0]

    def discretise(self, time: float, tick: float, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Exact discretisation x(t + tick) = Phi x(t) + Gamma u under an acceleration u held over the tick.

        u is held in the Hill frame, which rotates. For a nonlinear model, Phi and Gamma are the derivatives of
        the state after the tick with respect to the state before it and to u, along the free motion from `state`.

        Returns:
            Phi (6, 6) and Gamma (6, 3).
        """
        joint = np.zeros((6, 10))
        joint[:, 0] = state
        joint[:, 1:7] = np.eye(6)

        def rate(moment: float, columns: Array) -> Array:
            result = np.zeros_like(columns)
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

    def bounded(self, time: float, state: Array) -> Array:
        """(6,) state with the along-track rate for which free motion does not drift along the track.

        Position and the other rates are those of `state`. The condition here is that the along-track position
        repeats after one period; a model with a better one states it.
        """
        result = np.array(state, dtype=np.float64)
        for _ in range(50):  # Newton's method; one step for a linear model
            drift = self.propagate(time, result, self.period)[1] - result[1]
            change = -drift / self.transition(time, self.period, result)[1, 4]
            result[4] += change
            if self.is_linear or abs(change) <= 1e-14 * np.abs(result[3:]).max():
                break
        return result


class LinearModel(RelativeModel):
    """A model whose right-hand side is `dynamics(t) x + B u`."""

    is_linear = True

    def transitions(self, time: float, durations: Array) -> Array:
        """(N, 6, 6) state transition matrices from one time over durations (N,), s."""
        return np.array([self.transition(time, float(duration)) for duration in durations])

    def anchored(self, chief: Array, time: float) -> Self:
        """The model about the orbit that an inertial state (6,) of the chief is on at a time (s)."""
        return self

    def averaged(self, chief: Array, state: Array) -> Array:
        """(6,) relative state as the model has it, of one (6,) that is flown about a chief's inertial state (6,).

        Without the short-period perturbations if the model leaves them out; elsewhere the same.
        """
        return state

    def continued(self, state: Array, other: Self) -> Array:
        """(6,) state at time zero, in this model, of the motion that has a state (6,) there in another anchoring."""
        return state

    def phase_rates(self, time: float) -> tuple[float, float]:
        """Rates (rad/s) of the in-plane and the cross-track oscillation at a time."""
        return math.tau / self.period, math.tau / self.period

    def derivative(self, time: float, state: Array, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) rate of change of the relative state (..., 6) under an acceleration (..., 3)."""
        free: Array = np.asarray(state) @ self.dynamics(time).T
        return free + np.asarray(acceleration) @ INPUT.T

    def propagate(self, time: float, state: Array, duration: float, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) state after `duration` from a state (..., 6) under a held acceleration (..., 3)."""
        if acceleration is NO_THRUST:
            free: Array = np.asarray(state) @ self.transition(time, duration).T
            return free
        phi, gamma = self.discretise(time, duration)
        moved: Array = np.asarray(state) @ phi.T
        return moved + np.asarray(acceleration) @ gamma.T


def integrate(
    rate: Callable[[float, Array], Array], time: float, value: Array, duration: float, longest_step: float
) -> Array:
    """Value after `duration` (of either sign) of d(value)/dt = rate(t, value), in equal steps of order eight.

    Fixed steps make the result reproducible to the bit and smooth in the arguments; step control would not.
    """
    if duration == 0.0:
        return value
    steps = math.ceil(abs(duration) / longest_step)
    step = duration / steps
    coupling, weights = COUPLING * step, WEIGHTS * step
    stages = np.empty((STAGES, *value.shape))
    for index in range(steps):
        moments = time + (index + INSTANTS) * step
        stages[0] = rate(float(moments[0]), value)
        for stage in range(1, STAGES):
            change = np.tensordot(coupling[stage, :stage], stages[:stage], 1)
            stages[stage] = rate(float(moments[INSTANT_OF_STAGE[stage]]), value + change)
        value = value + np.tensordot(weights, stages, 1)
    return value
