"""Tracking of the chief: its ephemeris while it is plausible, else the propagated orbit."""

import numpy as np

from formation_gnc.navigation.kernels import motion
from formation_gnc.navigation.measurement_checks import is_plausible_chief
from formation_gnc.navigation.step import StepConstants
from formation_gnc.types import Vector

_NO_ACCELERATION = np.zeros(3)


class ChiefTracker:
    """Chief's inertial state (6,), m and m/s."""

    def __init__(self, ephemeris: Vector) -> None:
        """Start from an ephemeris that has been checked."""
        self.state = ephemeris
        self.is_lost = False
        """Whether the state is propagated, because the ephemeris is missing or not plausible."""
        self._ephemeris = self._last = ephemeris

    def advance(self, ephemeris: Vector | None, step: StepConstants) -> Vector:
        """Take the ephemeris (6,) at the end of a step, or propagate where there is none or it jumped."""
        if ephemeris is not None:
            self._last, self._ephemeris = self._ephemeris, ephemeris
        if ephemeris is not None and _agrees(self.state, ephemeris, step):
            self.state, self.is_lost = ephemeris, False
        else:
            self.state = motion.coast(self.state, _NO_ACCELERATION, step.seconds, step.substeps)
            self.is_lost = True
        return self.state

    def resume(self, step: StepConstants) -> bool:
        """Return to an ephemeris that jumped, once it has moved on along an orbit from its last value.

        Args:
            step: constants of a tick.

        Returns:
            Whether it has, and `state` is the ephemeris again.
        """
        last, ephemeris = self._last, self._ephemeris
        if is_plausible_chief(last) and is_plausible_chief(ephemeris) and _agrees(last, ephemeris, step):
            self.state, self.is_lost = ephemeris, False
            return True
        return False


def _agrees(chief: Vector, ephemeris: Vector, step: StepConstants) -> bool:
    agrees: bool = motion.ephemeris_agrees(
        chief, ephemeris, step.seconds, step.substeps, step.chief_distance, step.chief_speed
    )
    return agrees
