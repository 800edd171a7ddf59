"""Hill's equations (Clohessy and Wiltshire), with their closed form under constant thrust."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from formation_gnc.errors import ConfigurationError
from formation_gnc.relative.model import NO_THRUST, ON_THE_CHIEF, Array, LinearModel


@dataclass(frozen=True)
class HillModel(LinearModel):
    """Linear relative motion about a chief on a circular orbit of point-mass gravity.

    Assumes: circular chief, spherical Earth, separation much smaller than the orbit's radius (the error grows
    with its square). Source: Roberts (9); Kremmydas section 1.1.3 with thrust, in its own axes; docs/theory.

    Here `time` has no effect, and `transition`, `discretise` and `propagate` also take an array of durations
    (...,) and then give (..., 6, 6), (..., 6, 3) and (..., 6): a whole trajectory in one call.
    """

    mean_motion: float
    """Angular rate of the chief (rad/s), positive."""

    is_time_invariant = True

    def __post_init__(self) -> None:
        """Refuse a rate that is not one."""
        if not (math.isfinite(self.mean_motion) and self.mean_motion > 0.0):
            raise ConfigurationError(
                f"mean_motion is {self.mean_motion} rad/s: it must be positive and finite"
            )

    @property
    def longest_step(self) -> float:
        """Unlimited: closed forms throughout."""
        return math.inf

    def dynamics(self, time: float = 0.0, state: Array = ON_THE_CHIEF) -> Array:
        """(6, 6) continuous matrix A (Roberts (9))."""
        n = self.mean_motion
        matrix = np.zeros((6, 6))
        matrix[:3, 3:] = np.eye(3)
        matrix[3, 0] = 3.0 * n**2
        matrix[3, 4] = 2.0 * n
        matrix[4, 3] = -2.0 * n
        matrix[5, 2] = -(n**2)
        return matrix

    def bounded(self, time: float, state: Array) -> Array:
        """(..., 6) state with the along-track rate -2 n x, for which the closed form has no secular term."""
        result = np.array(state, dtype=np.float64)
        result[..., 4] = -2.0 * self.mean_motion * result[..., 0]
        return result

    def transition(self, time: float, duration: ArrayLike, state: Array = ON_THE_CHIEF) -> Array:
        """(..., 6, 6) state transition matrix over durations (...,)."""
        n = self.mean_motion
        angle = n * np.asarray(duration, dtype=np.float64)
        sine, cosine = np.sin(angle), np.cos(angle)
        versine = 2.0 * np.sin(0.5 * angle) ** 2  # 1 - cos, without cancellation over a short tick
        phi = np.zeros((*angle.shape, 6, 6))
        phi[..., 0, 0] = 1.0 + 3.0 * versine
        phi[..., 0, 3] = sine / n
        phi[..., 0, 4] = 2.0 * versine / n
        phi[..., 1, 0] = -6.0 * _angle_minus_sine(angle)
        phi[..., 1, 1] = 1.0
        phi[..., 1, 3] = -2.0 * versine / n
        phi[..., 1, 4] = (4.0 * sine - 3.0 * angle) / n
        phi[..., 2, 2] = cosine
        phi[..., 2, 5] = sine / n
        phi[..., 3, 0] = 3.0 * n * sine
        phi[..., 3, 3] = cosine
        phi[..., 3, 4] = 2.0 * sine
        phi[..., 4, 0] = -6.0 * n * versine
        phi[..., 4, 3] = -2.0 * sine
        phi[..., 4, 4] = 1.0 - 4.0 * versine
        phi[..., 5, 2] = -n * sine
        phi[..., 5, 5] = cosine
        return phi

    def discretise(self, time: float, tick: ArrayLike, state: Array = ON_THE_CHIEF) -> tuple[Array, Array]:
        """Phi (..., 6, 6) and Gamma (..., 6, 3) over durations (...,) of held acceleration.

        Gamma is the constant-thrust part of the closed form (Kremmydas section 1.1.3).
        """
        n = self.mean_motion
        angle = n * np.asarray(tick, dtype=np.float64)
        sine = np.sin(angle)
        versine = 2.0 * np.sin(0.5 * angle) ** 2
        lag = 2.0 * _angle_minus_sine(angle) / n**2
        gamma = np.zeros((*angle.shape, 6, 3))
        gamma[..., 0, 0] = versine / n**2
        gamma[..., 0, 1] = lag
        gamma[..., 1, 0] = -lag
        gamma[..., 1, 1] = (4.0 * versine - 1.5 * angle**2) / n**2
        gamma[..., 2, 2] = versine / n**2
        gamma[..., 3, 0] = sine / n
        gamma[..., 3, 1] = 2.0 * versine / n
        gamma[..., 4, 0] = -2.0 * versine / n
        gamma[..., 4, 1] = (4.0 * sine - 3.0 * angle) / n
        gamma[..., 5, 2] = sine / n
        return self.transition(time, tick), gamma

    def propagate(
        self, time: float, state: Array, duration: ArrayLike, acceleration: Array = NO_THRUST
    ) -> Array:
        """(..., 6) states after durations (...,) under a held acceleration, all broadcast together."""
        free, forced = self.discretise(time, duration)
        moved: Array = (free @ np.asarray(state)[..., None])[..., 0]
        return moved + (forced @ np.asarray(acceleration)[..., None])[..., 0]


def _angle_minus_sine(angle: Array) -> Array:
    """Return angle - sin(angle) to full relative precision: over a tick the two agree to ten digits."""
    square = angle**2
    series = angle * square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
    result: Array = np.where(np.abs(angle) < 0.1, series, angle - np.sin(angle))
    return result
