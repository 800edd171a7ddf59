"""Thrust that a target needs beyond free motion."""

from math import ceil

import numpy as np

from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.model import NO_THRUST, RelativeModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

LONGEST_STEP = 60.0
"""Integration step, s: of order eight, far below a millimetre per step."""


class FeedForward:
    """The known mismatch between the target's motion and free motion (Joshi 4.13, in the sign that helps:
    dX_d/dt - A X_d).

    Not from a derivative, which no message carries: the target of now flies freely to the time of the first
    preview state, and the acceleration that, held until then, would give it the velocity there instead is the
    feed-forward. It is a mean over that time. The positions are left out: over a short time they would blow
    up any inconsistency of the target's position and velocity.
    """

    def __init__(self, kind: str, model: RelativeModel) -> None:
        """Free motion of `kind` "linear" is the model's, of "nonlinear" the exact one under J2; of "none"
        there is none."""
        self._kind = kind
        self._model = model
        self._inverse: tuple[float, Matrix] = (0.0, np.zeros((3, 3)))

    def __call__(self, estimate: NavigationState, target: Target) -> tuple[Vector, str]:
        """Acceleration (3,), Hill frame, m/s^2, and why there is none when there should be."""
        if self._kind == "none":
            return NO_THRUST, ""
        if not len(target.preview):
            return NO_THRUST, "no feed-forward: the target has no preview"
        ahead = target.preview_step / NANOSECONDS
        missing = target.preview[0, 3:] - self._free(estimate, target.relative_state, ahead)[3:]
        acceleration: Vector = self._thrust_over(ahead) @ missing
        return acceleration, ""

    def _free(self, estimate: NavigationState, state: Vector, ahead: float) -> Vector:
        if self._kind == "linear":
            return self._model.propagate(estimate.time / NANOSECONDS, state, ahead)
        steps = ceil(ahead / LONGEST_STEP)
        chief, deputy = estimate.chief_state, inertial_from_relative(estimate.chief_state, state)
        return relative_from_inertial(
            advance_with_transition(chief, NO_THRUST, ahead, steps)[0],
            advance_with_transition(deputy, NO_THRUST, ahead, steps)[0],
        )

    def _thrust_over(self, ahead: float) -> Matrix:
        """(3, 3) inverse of what a held acceleration does to the velocity; Hill's axes turn little
        meanwhile."""
        if self._inverse[0] != ahead:
            inverse = np.linalg.inv(self._model.discretise(0.0, ahead)[1][3:])
            self._inverse = ahead, np.asarray(inverse, dtype=np.float64)
        return self._inverse[1]
