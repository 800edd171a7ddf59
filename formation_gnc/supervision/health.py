"""All monitors of a satellite, fed tick by tick."""

from collections.abc import Iterator, Sequence
from functools import cache
from math import isfinite

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Condition
from formation_gnc.records import Estimate, EstimateStatus, Measurement, Status, Target, Thrust
from formation_gnc.supervision.modes import Mode
from formation_gnc.supervision.monitor import Level, Monitor, Observation, Verdict, When
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.reckoning import DeadReckoner, Reckoning
from formation_gnc.supervision.registry import MONITORS
from formation_gnc.supervision.thrust_tally import ThrustTally
from formation_gnc.types import NANOSECONDS, Vector

_ACQUIRED = int(EstimateStatus.ACQUIRED)

_READINGS, _SLOW, _RARE, _THRUST, _SEPARATION, _GAP = (each.value for each in When)
"""Kinds of ticks, as numbers: a tick may be of several."""

RARE = 60.0
"""Time between rare ticks, s, and at least that between slow ones."""


class Health:
    """The monitors of a satellite, with what they share: the tally of thrust, and dead reckoning.

    Most ticks bring nothing but a force, which the tally takes. The others are observations, for the monitors that
    want them. One that raises an exception has failed by that, and is fed again.
    """

    def __init__(self, parameters: SupervisorParameters) -> None:
        """All monitors, each with an equal share of the probability of a false alarm.

        Raises:
            ConfigurationError: one cannot be prepared for these parameters.
        """
        share = parameters.false_alarm / len(MONITORS)
        self.monitors = [_prepared(kind, parameters, share) for kind in MONITORS.values()]
        self._fed = cache(self._chosen)
        self._tick_ns = parameters.tick_ns
        self._thrust = ThrustTally(parameters, share)
        self._reckoner = DeadReckoner(parameters.tick_ns, self._thrust.memory)
        slow = self._reckoner.ticks
        self._rare = slow * max(1, round(RARE * NANOSECONDS / (slow * parameters.tick_ns)))
        """Ticks between rare ones."""
        self.notable: list[Verdict] = []
        """The latest verdicts that are not well, in the order of the registry; a new list where any monitor was fed."""
        self._last: int | None = None
        self._commanded: Vector | None = None
        self._continues = self._in_eclipse = self._was_suspect = False

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
        missed = 1 if last is None else (time - last) // self._tick_ns - 1
        tick = time // self._tick_ns
        left = -tick % self._reckoner.ticks
        if estimate is None or estimate.status == _ACQUIRED:
            self._continues = False
        is_suspect = self._tally(measurement, missed, left)
        self._commanded = None if thrust is None else thrust.force
        kinds = 0 if left else _SLOW if tick % self._rare else _SLOW | _RARE
        if (measurement and measurement.readings) or (estimate and estimate.innovations):
            kinds |= _READINGS
        if is_suspect or self._was_suspect:
            kinds |= _THRUST
        separation = target.separation[0] if target is not None and target.separation else None
        kinds |= (_SEPARATION if separation is not None else 0) | (_GAP if missed else 0)
        self._was_suspect = is_suspect
        if kinds:
            if estimate is not None and not isfinite(sum(estimate.relative_state.tolist())):
                estimate = None
            reckoning = self._reckon(measurement, estimate) if left == 0 else None
            given = measurement, estimate, target, status, separation
            observation = Observation(time, missed, left == 0, mode, *given, self._thrust, reckoning)
            for monitor in self._fed(kinds):
                try:
                    monitor.feed(observation)
                except Exception as error:  # whatever a plug-in's raises
                    monitor.fail(f"{type(error).__name__}: {error}")
            self._note()
        return True

    def begin_anew(self) -> None:
        """Forget what was of a run of the filter: it goes on from another state, or about another chief."""
        self._continues = False
        for monitor in self.monitors:
            if monitor.is_of_filter:
                for subject in list(monitor.notable):
                    monitor.forget(subject)
                monitor.prepare()
        self._note()

    def _note(self) -> None:
        self.notable = [each for monitor in self.monitors if monitor.notable for each in monitor.notable.values()]

    def _chosen(self, kinds: int) -> list[Monitor]:
        """Monitors to be fed at a tick of these kinds."""
        return [each for each in self.monitors if each.when & When(kinds)]

    def _tally(self, measurement: Measurement | None, missed: int, left: int) -> bool:
        if missed or measurement is None:
            self._reckoner.reset()
            self._thrust.interrupt()
        if measurement is None:
            self._in_eclipse = False
            return False
        is_suspect = self._thrust.add(measurement, None if missed else self._commanded, self._in_eclipse, left)
        self._in_eclipse = measurement.eclipse
        return is_suspect

    def _reckon(self, measurement: Measurement | None, estimate: Estimate | None) -> Reckoning | None:
        if measurement is None:
            return None
        reckoning = self._reckoner.compare(measurement, estimate, self._continues)
        self._continues = estimate is not None
        return reckoning

    def verdicts(self) -> Iterator[Verdict]:
        """The latest verdict of every monitor on each of its subjects, in the order of the registry."""
        for monitor in self.monitors:
            yield from monitor.verdicts()

    def conditions(self, are_judged: bool) -> list[Condition]:
        """The latest verdict of every monitor: the worst of its subjects, with all of them as values."""
        return [condition(each.name, list(each.verdicts()) if are_judged else []) for each in self.monitors]


def condition(monitor: str, verdicts: Sequence[Verdict]) -> Condition:
    """What a monitor says of all its subjects."""
    values = {each.subject or "statistic": f"{each.statistic:.6g} of {each.threshold:.6g}" for each in verdicts}
    worst = max((each.level for each in verdicts), default=Level.OK)
    subjects = [each.subject for each in verdicts if each.level is worst and each.subject]
    words = {Level.OK: "well", Level.SUSPECT: "suspect", Level.FAILED: "failed"}[worst] if verdicts else "no verdict"
    message = f"{words}: {', '.join(subjects)}" if subjects and worst is not Level.OK else words
    return Condition(monitor, int(worst), message, values)


def _prepared(kind: type[Monitor], parameters: SupervisorParameters, probability: float) -> Monitor:
    try:
        return kind(parameters, probability)
    except ConfigurationError:
        raise
    except Exception as error:  # whatever a plug-in's raises
        raise ConfigurationError(f"monitor {kind.name}: cannot be prepared: {type(error).__name__}: {error}") from error
