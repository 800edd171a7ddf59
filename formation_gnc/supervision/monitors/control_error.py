"""A control error that grows although thrust is free."""

from math import dist, hypot, inf, isfinite, tau

from formation_gnc.orbit.frames import hill_rate
from formation_gnc.records import EstimateStatus, Target
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.types import NANOSECONDS, Vector

UNCONTROLLED = "coast"
"""Law that does nothing about an error."""

FACTOR = 2.0
"""Of the tube: an error that has been within it does not come to this without a fault."""

JUDGED = (Mode.KEEP, Mode.ACQUIRE)
"""Modes in which the error is judged."""

WINDOW = 0.125
"""Length of a window, revolutions."""

CURVATURE, LEAP = 2.0, 0.5
"""Largest distance of a relative orbit from its tangent, over the distance from the chief and the square of the chief's
angle (Hill's equations: at most 1.5 for the radial, less for the other axes); that of a leap besides, over the tube."""

GROWING = 4
"""Windows in a row with a growing least error: longer than an error swings out on a free orbit."""


class ControlError(Monitor):
    """Distance of estimate and target: out of the tube again once it was in, or growing window by window.

    Not judged while the controller is saturated, on a fallback or told to coast, and in other modes than `keep` and
    `acquire`. A target that leaps, as when a formation or its size is changed at once, is to be reached anew.

    Assumes: a tube that the law holds without a fault, noise of the estimate included; the error of a law on its way to
    the target swings out by less than half a revolution.
    Cannot see: an error of the estimate.
    Delay: until twice the tube, which depends on the fault; half a revolution for growth.
    """

    name = "control_error"
    title = "control error, growing although thrust is free"
    test = "bound, twice the tube once it was reached; else four windows of growth"
    when = When.RARE

    def prepare(self) -> None:
        """On the way to the target."""
        self._window = WINDOW * tau / self.parameters.mean_motion * NANOSECONDS
        self._target: Target | None = None
        self._restart(False)

    def _restart(self, reached: bool) -> None:
        self._reached = reached
        self._least, self._before = inf, inf
        self._growing, self._begun = 0, -1

    def feed(self, observation: Observation) -> None:
        """Judge the error."""
        estimate, target, status = observation.estimate, observation.target, observation.status
        is_controlled = status is not None and status.algorithm != UNCONTROLLED
        if estimate is None or target is None or not is_controlled or observation.mode not in JUDGED:
            self._restart(False)
            self.forget("")
            return
        if self._is_new(target, estimate.chief_state) or estimate.status == EstimateStatus.ACQUIRED:
            self._restart(False)
        self._target = target
        error = dist(estimate.relative_state.tolist()[:3], target.relative_state.tolist()[:3])
        if not isfinite(error):
            return
        if status is None or status.fallback or True in status.saturated:
            self._restart(self._reached)
        tube = self.parameters.tube
        self._reached |= error <= tube
        self._least = min(self._least, error)
        if self._begun < 0:
            self._begun = observation.time
        if observation.time - self._begun >= self._window:
            self._growing = self._growing + 1 if self._before < self._least else 0
            self._before, self._least, self._begun = self._least, inf, observation.time
        growth = self._growing / GROWING if error > FACTOR * tube else 0.0
        statistic = max(growth, error / (FACTOR * tube) if self._reached else 0.0)
        self.judge("", statistic, 0.75, 1.0)

    def _is_new(self, target: Target, chief: Vector) -> bool:
        """Whether a target is of another formation, or off the straight line of the last one by more than it curves."""
        last = self._target
        if last is None or target.formation != last.formation:
            return True
        seconds = (target.time - last.time) / NANOSECONDS
        position, before = target.relative_state[:3].tolist(), last.relative_state.tolist()
        angle = hill_rate(chief) * seconds
        curved = CURVATURE * angle**2 * max(hypot(*position), hypot(*before[:3]))
        off = dist(position, [before[axis] + seconds * before[3 + axis] for axis in range(3)])
        return off > LEAP * self.parameters.tube + curved
