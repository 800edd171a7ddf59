"""Feed-forward acceleration for a target that is not in free motion."""

from math import ceil

import numpy as np

from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.model import NO_THRUST, RelativeModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

MAX_STEP = 60.0
"""Integration step, s: at order eight, far below a millimetre per step."""


class FeedForward:
    """Acceleration of the target relative to free motion, dX_d/dt - A X_d (Joshi 4.13, sign corrected).

    The target state is propagated freely to the first preview state. The feed-forward is the mean acceleration
    that, held until then, attains the previewed velocity. Positions are not used: divided by the square of a
    short time, any inconsistency of the target's position and velocity would be amplified.
    """

    def __init__(self, kind: str, model: RelativeModel) -> None:
        """`kind` is "none", "linear" (free motion of the model) or "nonlinear" (exact free motion with J2)."""
        self._kind = kind
        self._model = model
        self._inverse: tuple[float, Matrix] = (0.0, np.zeros((3, 3)))

    def __call__(self, estimate: NavigationState, target: Target) -> tuple[Vector, str]:
        """Acceleration (3,), Hill frame, m/s^2, and the reason if it is unavailable."""
        if self._kind == "none":
            return NO_THRUST, ""
        if not len(target.preview):
            return NO_THRUST, "no feed-forward: the target has no preview"
        ahead = target.preview_step / NANOSECONDS
        missing = target.preview[0, 3:] - self._free_motion(estimate, target.relative_state, ahead)[3:]
        acceleration: Vector = self._acceleration_per_velocity(ahead) @ missing
        return acceleration, ""

    def _free_motion(self, estimate: NavigationState, state: Vector, ahead: float) -> Vector:
        if self._kind == "linear":
            time = self._model.time_at(estimate.chief_state, estimate.time / NANOSECONDS)
            return self._model.propagate(time, state, ahead)
        steps = ceil(ahead / MAX_STEP)
        chief, deputy = estimate.chief_state, inertial_from_relative(estimate.chief_state, state)
        return relative_from_inertial(
            propagate_with_transition(chief, NO_THRUST, ahead, steps)[0],
            propagate_with_transition(deputy, NO_THRUST, ahead, steps)[0],
        )

    def _acceleration_per_velocity(self, ahead: float) -> Matrix:
        """(3, 3) held acceleration per change of velocity after `ahead` (s); cached for the last value."""
        if self._inverse[0] != ahead:
            inverse = np.linalg.inv(self._model.discretise(0.0, ahead)[1][3:])
            self._inverse = ahead, np.asarray(inverse, dtype=np.float64)
        return self._inverse[1]
