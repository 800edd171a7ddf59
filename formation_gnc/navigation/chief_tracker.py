"""Tracking of the chief: its ephemeris while it is plausible, else the propagated orbit."""

from collections import deque
from typing import Self

import numpy as np

from formation_gnc.navigation.kernels import motion
from formation_gnc.navigation.measurement_checks import is_plausible_chief
from formation_gnc.navigation.process import substeps
from formation_gnc.navigation.step import StepConstants
from formation_gnc.types import Vector

MEMORY = 300.0
"""Age of the ephemeris from which the orbit is propagated where later ones are not trusted, s: at least the window in
which supervision finds one that is off."""

JUMPS = 8
"""Jumps that are remembered."""

_NO_ACCELERATION = np.zeros(3)


class ChiefTracker:
    """Chief's inertial state (6,), m and m/s."""

    def __init__(self, ephemeris: Vector) -> None:
        """Start from an ephemeris that has been checked."""
        self.state = ephemeris
        self.is_lost = False
        """Whether the state is propagated, because the ephemeris is missing or not plausible."""
        self.is_isolated = False
        """Whether it is propagated, because the ephemeris is not trusted."""
        self._ephemeris = self._last = ephemeris
        self._elapsed = 0.0
        self._kept = deque([(0.0, ephemeris)])
        """Earlier states with their times, s, the last one that is old enough first."""
        self._jumps = deque[tuple[float, Vector, Vector]](maxlen=JUMPS)
        """Times at which an ephemeris that had jumped was taken up, s, with the states before and after."""

    @classmethod
    def propagated(cls, state: Vector, seconds: float) -> Self:
        """One without an ephemeris that is trusted, from an earlier state (6,)."""
        tracker = cls(_coasted(state, seconds))
        tracker.is_isolated = True
        return tracker

    def advance(self, ephemeris: Vector | None, step: StepConstants) -> Vector:
        """Take the ephemeris (6,) at the end of a step, or propagate where there is none or it jumped."""
        if ephemeris is not None:
            self._last, self._ephemeris = self._ephemeris, ephemeris
        if ephemeris is not None and not self.is_isolated and _agrees(self.state, ephemeris, step):
            self.state, self.is_lost = ephemeris, False
        else:
            self.state = motion.coast(self.state, _NO_ACCELERATION, step.seconds, step.substeps)
            self.is_lost = not self.is_isolated
        self._elapsed += step.seconds
        if self._elapsed - self._kept[-1][0] >= 0.5 * MEMORY:
            self._kept.append((self._elapsed, self.state))
            while self._elapsed - self._kept[1][0] >= MEMORY:
                self._kept.popleft()
        return self.state

    def isolate(self, relative: Vector) -> tuple[float, Vector]:
        """Go on without the ephemeris, from an earlier one.

        Where the ephemeris was followed tick by tick, the relative state was propagated beside it and is right; where
        it jumped and was taken up again, the state was related to it anew, which is undone.

        Args:
            relative: state (6,) of the deputy, Hill frame.

        Returns:
            Age of the earlier ephemeris, s, and the state related to the chief that is propagated from it.
        """
        self.is_isolated, self.is_lost = True, False
        then, state = self._kept[0]
        for when, before, after in reversed(self._jumps):
            if when > then:
                relative = motion.change_chief(self._since(when, after), relative, self._since(when, before))
        self.state = self._since(then, state)
        return self._elapsed - then, relative

    def _since(self, time: float, state: Vector) -> Vector:
        """A state (6,) at an earlier time (s), propagated to now."""
        return _coasted(state, self._elapsed - time)

    def resume(self, step: StepConstants) -> bool:
        """Return to an ephemeris that jumped, once it has moved on along an orbit from its last value.

        Args:
            step: constants of a tick.

        Returns:
            Whether it has, and `state` is the ephemeris again.
        """
        last, ephemeris = self._last, self._ephemeris
        if is_plausible_chief(last) and is_plausible_chief(ephemeris) and _agrees(last, ephemeris, step):
            self._jumps.append((self._elapsed, self.state, ephemeris))
            self.state, self.is_lost = ephemeris, False
            return True
        return False


def _coasted(state: Vector, seconds: float) -> Vector:
    """A state (6,) after a time (s) without thrust; itself after none."""
    coasted: Vector = motion.coast(state, _NO_ACCELERATION, seconds, substeps(seconds)) if seconds > 0.0 else state
    return coasted


def _agrees(chief: Vector, ephemeris: Vector, step: StepConstants) -> bool:
    agrees: bool = motion.ephemeris_agrees(
        chief, ephemeris, step.seconds, step.substeps, step.chief_distance, step.chief_speed
    )
    return agrees
