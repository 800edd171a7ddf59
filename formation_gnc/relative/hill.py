"""Hill's equations (Clohessy and Wiltshire), with their closed form under constant thrust."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.kernels import harmonic_transition, sine_lag
from formation_gnc.relative.model import NO_THRUST, ON_THE_CHIEF, Array, LinearModel


class HarmonicModel(LinearModel):
    """A time-invariant model of Hill's form, in closed form under constant thrust.

    x'' = 2 w y' + (4 w^2 - q^2) x + ux,  y'' = -2 w x' + uy,  z'' = -p^2 z + uz

    with the frame's rate w, the in-plane frequency q and the cross-track frequency p. `time` has no effect.
    `transition`, `discretise` and `propagate` also accept durations (...,), for results (..., 6, 6), (..., 6, 3)
    and (..., 6): a whole trajectory in one call.
    """

    is_time_invariant = True
    is_periodic = True
    has_closed_form = True

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """The rate w and the frequencies q and p, rad/s."""
        raise NotImplementedError

    @property
    def period(self) -> float:
        """Period of the in-plane motion, s."""
        return math.tau / self.frequencies[1]

    @property
    def longest_step(self) -> float:
        """Unlimited: no integration."""
        return math.inf

    def phase_rates(self, time: float) -> tuple[float, float]:
        """In-plane and cross-track frequency, rad/s."""
        return self.frequencies[1:]

    def dynamics(self, time: float = 0.0, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A."""
        w, q, p = self.frequencies
        matrix = np.zeros((6, 6))
        matrix[:3, 3:] = np.eye(3)
        matrix[3, 0] = 4.0 * w**2 - q**2
        matrix[3, 4] = 2.0 * w
        matrix[4, 3] = -2.0 * w
        matrix[5, 2] = -(p**2)
        return matrix

    def bounded(self, time: float, state: Array) -> Array:
        """(..., 6) state with the along-track rate -2 w x, for which the closed form has no secular term."""
        result = np.array(state, dtype=np.float64)
        result[..., 4] = -2.0 * self.frequencies[0] * result[..., 0]
        return result

    def transition(self, time: float, duration: ArrayLike, state: Array = ON_THE_CHIEF) -> Array:
        """(..., 6, 6) state transition matrix over durations (...,)."""
        w, q, p = self.frequencies
        t = np.asarray(duration, dtype=np.float64)
        sine, cosine, versine, lag = _circular_functions(q * t)
        normal_sine, normal_cosine = (sine, cosine) if p == q else (np.sin(p * t), np.cos(p * t))
        phi = np.empty((t.size, 6, 6))
        functions = sine, cosine, versine, lag, normal_sine, normal_cosine
        harmonic_transition(phi, (w, q, p), (w**2, q**2, q**3), *(np.ravel(each) for each in (t, *functions)))
        return phi.reshape(*t.shape, 6, 6)

    def transitions(self, time: float, durations: Array) -> Array:
        """(N, 6, 6) state transition matrices over durations (N,), s, in one call."""
        return self.transition(time, durations)

    def discretise(self, time: float, tick: ArrayLike, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (..., 6, 6) and Gamma (..., 6, 3) over durations (...,) of held acceleration."""
        w, q, p = self.frequencies
        t = np.asarray(tick, dtype=np.float64)
        sine, _, versine, lag = _circular_functions(q * t)
        normal_sine, _, normal_versine, _ = _circular_functions(p * t)
        gamma = np.zeros((*t.shape, 6, 3))
        gamma[..., 0, 0] = versine / q**2
        gamma[..., 0, 1] = 2.0 * w * lag / q**3
        gamma[..., 1, 0] = -2.0 * w * lag / q**3
        gamma[..., 1, 1] = t**2 / 2.0 - 4.0 * w**2 * (t**2 / 2.0 - versine / q**2) / q**2
        gamma[..., 2, 2] = normal_versine / p**2
        gamma[..., 3, 0] = sine / q
        gamma[..., 3, 1] = 2.0 * w * versine / q**2
        gamma[..., 4, 0] = -2.0 * w * versine / q**2
        gamma[..., 4, 1] = t - 4.0 * w**2 * lag / q**3
        gamma[..., 5, 2] = normal_sine / p
        return self.transition(time, tick), gamma

    def propagate(self, time: float, state: Array, duration: ArrayLike, acceleration: Array = NO_THRUST) -> Array:
        """(..., 6) states after durations (...,) under a held acceleration, all broadcast together."""
        phi, gamma = self.discretise(time, duration)
        free: Array = (phi @ np.asarray(state)[..., None])[..., 0]
        return free + (gamma @ np.asarray(acceleration)[..., None])[..., 0]


@dataclass(frozen=True)
class HillModel(HarmonicModel):
    """Linear relative motion about a chief on a circular orbit, under point-mass gravity.

    Assumes: circular chief, spherical Earth, separation much smaller than the orbit's radius (the error grows
    with its square). Source: Roberts (9); Kremmydas section 1.1.3 with thrust, in its own axes.

    Raises:
        OrbitError: a mean motion that is not positive and finite.
    """

    mean_motion: float
    """Angular rate of the chief, rad/s."""

    def __post_init__(self) -> None:
        """Reject a mean motion that is not positive and finite."""
        if not (math.isfinite(self.mean_motion) and self.mean_motion > 0.0):
            raise OrbitError(f"mean_motion is {self.mean_motion} rad/s: it must be positive and finite")

    @classmethod
    def about(cls, chief: Elements) -> Self:
        """At the chief's Keplerian mean motion."""
        return cls(chief.mean_motion)

    @property
    def frequencies(self) -> tuple[float, float, float]:
        """The mean motion, for all three."""
        return self.mean_motion, self.mean_motion, self.mean_motion


def _circular_functions(angle: Array) -> tuple[Array, Array, Array, Array]:
    """sin a, cos a, 1 - cos a and a - sin a, the last two without cancellation.

    Over a tick their terms agree to ten digits, which a subtraction would lose.
    """
    sine = np.sin(angle)
    lag = np.empty(np.shape(angle))
    sine_lag(np.ravel(angle), np.ravel(angle**2), np.ravel(sine), lag.reshape(-1))
    return sine, np.cos(angle), 2.0 * np.sin(0.5 * angle) ** 2, lag
