"""Past intervals of the prediction, for readings that arrive late."""

from collections import deque

import numpy as np

from formation_gnc.navigation.process import Interval, substeps
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.types import Matrix, Vector

_NO_ACCELERATION = np.zeros(3)


class StateHistory:
    """Latest prediction intervals, through which a state is propagated back to the time of a reading."""

    def __init__(self, length: int, earlier: "StateHistory | None" = None) -> None:
        """Keep at most `length` intervals, starting with those of an earlier history."""
        self._intervals: deque[Interval] = deque(earlier._intervals if earlier else (), maxlen=length)

    def add(self, interval: Interval) -> None:
        """Append the interval that ends now."""
        self._intervals.append(interval)

    def state_before(self, deputy: Vector, age: float) -> tuple[Vector, Matrix]:
        """Deputy's state at an earlier time.

        Args:
            deputy: inertial state now, (6,).
            age: time before now, s.

        Returns:
            Inertial state then, (6,), and its derivative with respect to the state now, (6, 6). Process noise in
            between is neglected.
        """
        transition = np.eye(6)
        for interval in reversed(self._intervals):
            if age <= 0.0:
                break
            duration = min(age, interval.duration)
            thrust = interval.acceleration @ hill_rotation(interval.chief)
            deputy, step = propagate_with_transition(deputy, thrust, -duration, substeps(duration))
            transition = step @ transition
            age -= duration
        if age > 0.0:
            deputy, step = propagate_with_transition(deputy, _NO_ACCELERATION, -age, substeps(age))
            transition = step @ transition
        return deputy, transition
