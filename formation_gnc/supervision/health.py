"""All monitors of a satellite, fed tick by tick."""

from collections.abc import Iterator
from itertools import product
from math import isfinite

from formation_gnc.records import Estimate, EstimateStatus, Measurement, Status, Target, Thrust
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Monitor, Observation, Verdict, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.reckoning import DeadReckoner, Reckoning
from formation_gnc.supervision.registry import MONITORS
from formation_gnc.types import NANOSECONDS


class Health:
    """The monitors of a satellite, with what they share: the tick before, and dead reckoning."""

    def __init__(self, parameters: SupervisorParameters) -> None:
        """All monitors, each with an equal share of the probability of a false alarm."""
        share = parameters.false_alarm / len(MONITORS)
        self.monitors: list[Monitor] = [kind(parameters, share) for kind in MONITORS.values()]
        kinds = product((False, True), repeat=2)
        self._fed = {(readings, slow): self._chosen(readings, slow) for readings, slow in kinds}
        self._tick_ns = parameters.tick_ns
        self._reckoner = DeadReckoner(parameters.tick_ns)
        self._last: int | None = None
        self._commanded: list[float] | None = None
        self._continues = False

    def feed(
        self,
        time: int,
        mode: Mode,
        measurement: Measurement | None,
        estimate: Estimate | None,
        target: Target | None,
        status: Status | None,
        thrust: Thrust | None,
    ) -> bool:
        """Feed all monitors; returns whether there was anything new: a time that is not later than the last is ignored.

        Args:
            time: stamp of all of them, ns.
            mode: in force.
            measurement: of this tick, as are the others, each None where there is none.
            estimate: of navigation.
            target: of guidance.
            status: of the controller.
            thrust: commanded for the tick that begins.
        """
        last = self._last
        if last is not None and time <= last:
            return False
        self._last = time
        missed = last is None or time - last > self._tick_ns
        if missed:
            self._reckoner.reset()
        if estimate is not None and not isfinite(sum(estimate.relative_state.tolist())):
            estimate = None
        if estimate is None or estimate.status == EstimateStatus.ACQUIRED:
            self._continues = False
        applied = None if measurement is None else measurement.applied_force.tolist()
        left = -(time // self._tick_ns) % self._reckoner.ticks
        slow = left == 0
        observation = Observation(
            time,
            0.0 if last is None else (time - last) / NANOSECONDS,
            missed,
            slow,
            mode,
            measurement,
            estimate,
            target,
            status,
            None if missed else self._commanded,
            applied,
            self._reckon(measurement, estimate, applied, left),
        )
        self._commanded = None if thrust is None else _finite(thrust.force.tolist())
        readings = bool((measurement and measurement.readings) or (estimate and estimate.innovations))
        for monitor in self._fed[readings, slow]:
            monitor.feed(observation)
        return True

    def _chosen(self, readings: bool, slow: bool) -> list[Monitor]:
        """Monitors to be fed at a tick with or without readings, slow or not."""
        due = When.ALWAYS | (When.READINGS if readings else When(0)) | (When.SLOW if slow else When(0))
        return [each for each in self.monitors if each.when & due]

    def _reckon(
        self, measurement: Measurement | None, estimate: Estimate | None, applied: list[float] | None, left: int
    ) -> Reckoning | None:
        if measurement is None or applied is None:
            self._reckoner.reset()
            return None
        if any(applied) and isfinite(sum(applied)) and 0.0 < measurement.mass < float("inf"):
            self._reckoner.add_thrust([each / measurement.mass for each in applied], left)
        if left:
            return None
        reckoning = self._reckoner.compare(measurement, estimate, self._continues)
        self._continues = estimate is not None
        return reckoning

    def verdicts(self) -> Iterator[Verdict]:
        """The latest verdict of every monitor on each of its subjects, in the order of the registry."""
        for monitor in self.monitors:
            yield from monitor.verdicts.values()

    def notable(self) -> list[Verdict]:
        """The latest verdicts that are not well."""
        return [verdict for monitor in self.monitors if monitor.notable for verdict in monitor.notable.values()]


def _finite(force: list[float]) -> list[float] | None:
    return force if isfinite(sum(force)) else None
