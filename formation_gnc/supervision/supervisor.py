"""Supervision of one deputy, from the records of a tick to its mode and health."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Condition, Configuration, FlightModule
from formation_gnc.mode_records import CHIEF, NO_FORCE, STATE, HealthReport, Mode, ModeState
from formation_gnc.parameters import change, to_json
from formation_gnc.records import (
    NO_NEIGHBOURS,
    Estimate,
    EstimateStatus,
    EventKind,
    Measurement,
    ParameterChange,
    Status,
    Target,
    Thrust,
)
from formation_gnc.supervision.fault_table import Entry, Response
from formation_gnc.supervision.health import Health
from formation_gnc.supervision.modes import COMMANDS, FAULTS, Step, Trigger, by_error, refusal, step
from formation_gnc.supervision.monitor import Level, Verdict
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.registry import read_fault_table
from formation_gnc.supervision.responses import (
    BY_INNOVATIONS,
    ActiveResponse,
    FaultResponses,
    Renewal,
    Restricted,
    restricted,
)
from formation_gnc.supervision.safe import Coast, Evasion, Manoeuvre, plan_evasion

QUIET = 60
"""Ticks without a failure after which the next one is reported again."""

EVASIVE = frozenset({Mode.AVOID, Mode.SAFE})
"""Modes that begin with a plan."""

UNTRUSTED = frozenset({"innovation_consistency", "estimate_jump", "frozen_estimate", "chief_ephemeris"})
"""Monitors whose failure says that the estimate is not to be steered by."""

SEPARATION = "separation"
"""Monitor by which `avoid` ends."""

type Design = tuple[Entry, ...]
type Configured = Configuration[SupervisorParameters, Design]

_decide = cache(step)
"""The same triggers come at tick after tick."""


class Supervisor(FlightModule[SupervisorParameters, Design]):
    """Mode and health of one deputy, at every tick that has a measurement, whatever the other modules do.

    At a tick it judges the one before, whose records are complete then: a module that has not answered it is
    known by the acquisition fix of the measurement. What it says holds from the next tick on. The parameter `mode`
    is a command when it is set, and follows the mode in force otherwise. One that is started again in flight goes
    on with the mode that the controller obeys.
    """

    def reset(self) -> None:
        """The mode of the parameters, monitors without a memory, no fault."""
        self._mode = Mode(self.parameters.mode)
        self._health = Health(self.parameters)
        self._responses = FaultResponses(self.configuration.design)
        self._active: list[ActiveResponse] = []
        self._restricted = Restricted()
        self._renewal = Renewal()
        self._failed: dict[tuple[str, str], int] = {}
        """Time (ns) of the latest failure by monitor and subject."""
        self._statuses: list[tuple[str, str, Level]] | None = None
        self._looked_at: list[Verdict] | None = None
        self._command: Trigger | None = None
        self._evasion: Evasion | None = None
        self._reason, self._since = "", 0
        self._in_force = self._mode
        """Mode over the tick before."""
        self._before: Measurement | None = None

    def design(self, parameters: SupervisorParameters) -> Design:
        """The fault table; raises ConfigurationError for one that is not allowed."""
        return read_fault_table(parameters)

    def check_staged(self, staged: Configured) -> None:
        """Refuse a mode that may not be commanded now."""
        self._check_command(staged)

    def check_due(self, time: int, due: Configured) -> None:
        """Refuse a mode that may not be commanded at its tick."""
        self._check_command(due)

    def first_of(self, waiting: Sequence[Measurement]) -> Measurement:
        """The first: nothing waits for it in the same tick, so that it may be behind, and every tick has a mode."""
        return waiting[0]

    def has_delayed_inputs(self, pacing: Measurement) -> bool:
        """Whether the tick before was answered: an acquisition fix comes when it was not."""
        return not pacing.fix_available

    def _check_command(self, wanted: Configured) -> None:
        if "mode" not in wanted.changes:
            return
        mode = Mode(wanted.changes["mode"])
        if mode is not self._mode and (reason := refusal(self._mode, mode)):
            raise ConfigurationError(f"mode {mode}: refused in {self._mode}; {reason}")

    def activate(self, old: Configured, new: Configured) -> None:
        """Take a command; begin anew with other monitors or another table."""
        if "mode" in new.changes and new.parameters.mode != self._mode:
            self._command = COMMANDS[Mode(new.parameters.mode)]
            self._responses.release()
        if new.design != old.design or "enabled" in new.changes:
            self._responses = FaultResponses(new.design)
            self._report(self.time, [])
            self._active, self._restricted, self._renewal = [], Restricted(), Renewal()
        if new.changes.keys() - {"mode", "fault_table", "schedule"}:
            self._health = Health(new.parameters)

    def on_tick(
        self,
        measurement: Measurement,
        estimate: Estimate | None = None,
        target: Target | None = None,
        status: Status | None = None,
        thrust: Thrust | None = None,
    ) -> tuple[ModeState | None, HealthReport | None]:
        """Mode at the measurement's stamp, and health where it has changed; neither for a measurement out of order.

        The other records are of the tick before, each None where there is none. A measurement of an earlier time
        begins a new run if it has an acquisition fix.
        """
        time, before = measurement.time, self._before
        if before is not None and (time == before.time or (time < before.time and not measurement.fix_available)):
            return None, None
        self.begin_tick(time)
        before = self._before
        if before is None and status is not None and status.mode in Mode:
            self._adopt(time, Mode(status.mode))
        triggers = self._events(estimate, target)
        if self.parameters.enabled and (before is not None or estimate is not None):
            self._judge(time, before, estimate, target, status, thrust)
        self._before = measurement
        if self._renewal.is_awaited and estimate is not None and estimate.status == EstimateStatus.ACQUIRED:
            self._begin_anew(time, estimate, target)
        if self._mode is Mode.AVOID and self._is_restored(target):
            triggers.append(Trigger.SEPARATION_RESTORED)
        return self._decide(time, triggers, estimate, target), self._health_report(time)

    def _judge(
        self,
        time: int,
        measurement: Measurement | None,
        estimate: Estimate | None,
        target: Target | None,
        status: Status | None,
        thrust: Thrust | None,
    ) -> None:
        """Feed the monitors with the tick before a time (ns), and update the responses."""
        tick = self.parameters.tick_ns
        ticks = 1
        if measurement is not None and measurement.time != time - tick:
            ticks, measurement = (time - measurement.time) // tick, None
        self._health.feed(time - tick, self._in_force, measurement, estimate, target, status, thrust)
        failures = [each for each in self._health.notable if each.level is Level.FAILED]
        for each in failures:
            key = each.monitor, each.subject
            if time - self._failed.get(key, -time) > QUIET * tick or key not in self._failed:
                self.log(time, EventKind.DETECTION, str(each), each.subject)
            self._failed[key] = time
        active = self._responses.evaluate([(each.monitor, each.subject) for each in failures], ticks, self._mode)
        if active != self._active:
            is_isolated = any(each.subject == CHIEF and each.response is Response.ISOLATE_SENSOR for each in active)
            if is_isolated != (CHIEF in self._restricted.sensors):
                active = self._withdraw(active)  # accused about another chief
            self._take(time, active)

    def _take(self, time: int, active: list[ActiveResponse]) -> None:
        """Take other responses from a time (ns) on."""
        self._report(time, active)
        self._active = active
        before, sensors = self._restricted.restrictions, len(self.parameters.sensors)
        self._restricted = restricted(active, sensors, before, self._renewal.is_over)
        if self._renewal.is_awaited:
            self._restricted.restrictions.append(self._renewal.restriction)

    def _withdraw(self, active: list[ActiveResponse]) -> list[ActiveResponse]:
        """Responses without those to innovations of the filter, which goes on otherwise, and is judged anew."""
        self._responses.withdraw(BY_INNOVATIONS)
        self._health.begin_anew()
        return [each for each in active if each.entry.monitor not in BY_INNOVATIONS]

    def _await_fix(self, time: int) -> None:
        """Have navigation begin anew from a fix: too many sensors contradict its state."""
        self._renewal = self._renewal.begun(self._restricted.blinded)
        self._restricted.restrictions = [*self._restricted.restrictions, self._renewal.restriction]
        detail = f"begins: {self._renewal.cause}: navigation begins anew from a fix"
        self.log(time, EventKind.RESPONSE, detail, STATE)

    def _begin_anew(self, time: int, estimate: Estimate, target: Target | None) -> None:
        """Find the way out again from a state that has just been acquired; thrust and its telemetry are doubted."""
        self._renewal = Renewal(is_over=True)
        self._take(time, self._withdraw(self._active))
        if self._mode is not Mode.SAFE:
            return
        self._evasion = self._way_out(time, estimate, target)
        self._renewal.is_due = isinstance(self._evasion, Manoeuvre)
        self.log(time, EventKind.MODE, f"state acquired anew; {self._evasion.words}", str(self._mode))

    def _decide(
        self, time: int, triggers: list[Trigger], estimate: Estimate | None, target: Target | None
    ) -> ModeState:
        faults = dict[Trigger, str]()
        for each in self._active:
            if each.response is Response.GO_TO and each.entry.mode is not None:
                faults.setdefault(FAULTS[each.entry.mode], each.cause)
        if self._restricted.blinded and self._mode is not Mode.STANDBY:  # which steers by nothing
            faults.setdefault(FAULTS[Mode.SAFE], self._restricted.blinded)
        if self._command is not None:
            triggers.append(self._command)
        self._command = None
        before, decided = self._mode, _decide(self._mode, (*triggers, *faults))
        for trigger, reason in decided.refusals:
            self.log(time, EventKind.REJECTED, f"{trigger}: {reason}", "mode")
        if decided.mode is not before:
            self._enter(time, decided, faults, estimate, target)
        elif self._is_fix_due(time):
            self._await_fix(time)
        self._in_force = before
        self._follow_mode()
        force = NO_FORCE if self._evasion is None else self._evasion.force(time + self.parameters.tick_ns)
        return ModeState(
            time, str(self._mode), str(before), self._since, self._reason, force, self._restricted.restrictions
        )

    def _enter(
        self,
        time: int,
        decided: Step,
        faults: dict[Trigger, str],
        estimate: Estimate | None,
        target: Target | None,
    ) -> None:
        """Go to another mode, from the tick after a time (ns) on."""
        before, self._mode = self._mode, decided.mode
        self._since = time + self.parameters.tick_ns
        trigger = decided.trigger
        self._reason = "" if trigger is None else f"{trigger}, {faults[trigger]}" if trigger in faults else str(trigger)
        detail = f"from {before}: {self._reason}"
        self._evasion = None
        if before is Mode.SAFE:
            self._renewal = Renewal()
            self._take(time, self._active)
        if self._mode in EVASIVE:
            self._evasion = self._way_out(time, estimate, target)
            detail += f"; {self._evasion.words}"
        self.log(time, EventKind.MODE, detail, str(self._mode), self._follow_mode())

    def _adopt(self, time: int, mode: Mode) -> None:
        """Go on in the mode in which the others fly, of a supervisor that is no more."""
        self._mode = self._in_force = mode
        if changes := self._follow_mode():
            self.log(time, EventKind.MODE, "adopted: the supervisor was started in flight", str(mode), changes)

    def _follow_mode(self) -> list[ParameterChange]:
        """Let the parameter be the mode; returns its change, if it is one."""
        before, after = str(self.parameters.mode), str(self._mode)
        if after == before:
            return []
        parameters = change(self.parameters, {"mode": after})
        self.configuration = replace(self.configuration, parameters=parameters)
        return [ParameterChange("mode", to_json(before), to_json(after))]

    def _is_fix_due(self, time: int) -> bool:
        """Whether sensors contradict the state in `safe`, and it was not begun anew since the last thrust."""
        if self._mode is not Mode.SAFE or not self._restricted.is_contradicted or not self._renewal.is_due:
            return False
        return self._evasion is None or time >= self._evasion.end

    def _way_out(self, time: int, estimate: Estimate | None, target: Target | None) -> Evasion:
        """The way out: away from the neighbours that guidance knows, with the axes that work."""
        start = time + self.parameters.tick_ns
        if self._mode is Mode.SAFE and self._restricted.is_contradicted and self._renewal.is_due:
            return Coast(start, "coasts until navigation has begun anew from a fix")
        failing = {each.monitor for each in self._health.notable if each.level is Level.FAILED}
        return plan_evasion(
            self._mode,
            start,
            estimate,
            self.parameters,
            NO_NEIGHBOURS if target is None else target.neighbours,
            self._restricted.axes,
            not self._restricted.blinded and UNTRUSTED.isdisjoint(failing),
            self._restricted.accused if self._renewal.is_over else None,
        )

    def _events(self, estimate: Estimate | None, target: Target | None) -> list[Trigger]:
        """Triggers by estimate and target of the tick before."""
        if estimate is None:
            return [] if self._before is None else [Trigger.STATE_LOST]
        triggers = [Trigger.ACQUIRED] if estimate.status == EstimateStatus.ACQUIRED else []
        if target is None:
            return triggers
        if target.reconfiguring:
            triggers.append(Trigger.RECONFIGURATION_BEGAN)
        elif self._mode is Mode.RECONFIGURE:
            triggers.append(Trigger.RECONFIGURATION_ENDED)
        error = estimate.relative_state[:3] - target.relative_state[:3]
        return [*triggers, *by_error(error, self.parameters.tube)]

    def _is_restored(self, target: Target | None) -> bool:
        """Whether a prediction made after the last burn is above the limit."""
        predicted = [] if target is None else target.separation
        if not predicted or self.parameters.least_separation <= 0.0 or not self.parameters.enabled:
            return False
        is_low = any(each.monitor == SEPARATION and each.level is Level.FAILED for each in self._health.notable)
        ended = self._since if self._evasion is None else self._evasion.end
        return predicted[0].time >= ended and not is_low

    def _report(self, time: int, active: list[ActiveResponse]) -> None:
        """Log responses that begin or end; a detection is warning enough."""
        changes = [("begins", each) for each in active if each not in self._active]
        changes += [("ends", each) for each in self._active if each not in active]
        for verb, each in changes:
            if each.entry.response is not Response.WARN:
                self.log(time, EventKind.RESPONSE, f"{verb}: {each}", each.subject)

    def _health_report(self, time: int) -> HealthReport | None:
        """The verdicts that are not well, where subjects or levels have changed."""
        notable = self._health.notable if self.parameters.enabled else []
        if notable is self._looked_at:
            return None
        self._looked_at = notable
        statuses = [(each.monitor, each.subject, each.level) for each in notable]
        if statuses == self._statuses:
            return None
        self._statuses = statuses
        return HealthReport(time, [each.status for each in notable])

    def conditions(self) -> list[Condition]:
        """The latest verdict of every monitor: the worst of its subjects, with all of them as values."""
        return self._health.conditions(self.parameters.enabled)
