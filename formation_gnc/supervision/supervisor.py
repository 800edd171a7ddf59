"""Supervision of one deputy, from the records of a tick to its mode and health."""

from dataclasses import replace
from functools import cache

from formation_gnc.common import ANY_ORBIT
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import Configuration, FlightModule
from formation_gnc.parameters import change
from formation_gnc.records import Estimate, EstimateStatus, EventKind, Measurement, Status, Target, Thrust
from formation_gnc.sensors.registry import sensors
from formation_gnc.supervision.fault_table import DEFAULT, Entry, Response, parse, table_of
from formation_gnc.supervision.health import Health
from formation_gnc.supervision.modes import COMMANDS, FAULTS, Mode, Step, Trigger, refusal, step
from formation_gnc.supervision.monitor import AXES, Level, Verdict
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.supervision.records import HealthReport, ModeState, MonitorStatus
from formation_gnc.supervision.registry import MONITORS
from formation_gnc.supervision.responses import ActiveResponse, FaultResponses

LEFT = 1.5
"""Control error, over the tube, beyond which the target counts as left."""

type Design = tuple[Entry, ...]

_decide = cache(step)
"""The same triggers come at tick after tick."""


class Supervisor(FlightModule[SupervisorParameters, Design]):
    """Mode and health of one deputy. What it says at a tick holds from the next one on.

    The parameter `mode` is a command when it is set, and follows the mode in force otherwise.
    """

    def reset(self) -> None:
        """The mode of the parameters, monitors without a memory, no fault."""
        self._mode = Mode(self.parameters.mode)
        self._health = Health(self.parameters)
        self._responses = FaultResponses(self.configuration.design)
        self._active: list[ActiveResponse] = []
        self._command: Trigger | None = None
        self._last = -1

    def design(self, parameters: SupervisorParameters) -> Design:
        """The fault table; raises ConfigurationError for one that is not allowed."""
        subjects = {name: monitor.subjects(parameters) for name, monitor in MONITORS.items()}
        return parse(parameters.fault_table, subjects, tuple(sensors()), AXES)

    def check_staged(self, staged: Configuration[SupervisorParameters, Design]) -> None:
        """Refuse a mode that may not be commanded now."""
        self._check_command(staged)

    def check_due(self, time: int, due: Configuration[SupervisorParameters, Design]) -> None:
        """Refuse a mode that may not be commanded at its tick."""
        self._check_command(due)

    def _check_command(self, wanted: Configuration[SupervisorParameters, Design]) -> None:
        if "mode" not in wanted.changes:
            return
        mode = Mode(wanted.changes["mode"])
        if mode is not self._mode and (reason := refusal(self._mode, mode)):
            raise ConfigurationError(f"mode {mode}: refused in {self._mode}; {reason}")

    def activate(
        self,
        old: Configuration[SupervisorParameters, Design],
        new: Configuration[SupervisorParameters, Design],
    ) -> None:
        """Take a command; begin anew with other monitors or another table."""
        if "mode" in new.changes and new.parameters.mode != self._mode:
            self._command = COMMANDS[Mode(new.parameters.mode)]
        if new.design != old.design:
            self._responses = FaultResponses(new.design)
        if new.changes.keys() - {"mode", "fault_table", "schedule"}:
            self._health = Health(new.parameters)

    def on_tick(
        self,
        measurement: Measurement,
        estimate: Estimate | None = None,
        target: Target | None = None,
        status: Status | None = None,
        thrust: Thrust | None = None,
    ) -> tuple[ModeState, HealthReport] | None:
        """Mode and health at the measurement's stamp; None for a measurement that is out of order.

        A measurement of an earlier time begins a new run if it has an acquisition fix.
        """
        time = measurement.time
        if time == self._last or (time < self._last and not measurement.fix_available):
            return None
        self.begin_tick(time)
        ticks = 1 if self._last < 0 else max(1, (time - self._last) // self.parameters.tick_ns)
        self._last = time
        self._health.feed(time, self._mode, measurement, estimate, target, status, thrust)
        notable = self._health.notable()
        failures = [(each.monitor, each.subject) for each in notable if each.level is Level.FAILED]
        active = self._responses.evaluate(failures, ticks, self._mode)
        self._report(time, active)
        return self._decide(time, estimate, target, active), self._health_report(time, notable, active)

    def _decide(
        self, time: int, estimate: Estimate | None, target: Target | None, active: list[ActiveResponse]
    ) -> ModeState:
        triggers, faults = self._events(estimate, target), dict[Trigger, str]()
        for each in active:
            if each.response is Response.GO_TO and each.entry.mode is not None:
                faults.setdefault(FAULTS[each.entry.mode], f"{each.entry.monitor} {each.subject}".strip())
        if self._command is not None:
            triggers.append(self._command)
        self._command = None
        before, decided = self._mode, _decide(self._mode, (*triggers, *faults))
        for trigger, reason in decided.refusals:
            self.log(time, EventKind.WARNING, f"{trigger}: refused, {reason}", "mode")
        reason = ""
        if decided.mode is not before:
            reason = self._reason(decided, faults)
            self._mode = decided.mode
            self.log(time, EventKind.WARNING, f"{before} to {decided.mode}: {reason}", "mode")
        if self.parameters.mode != self._mode:
            parameters = change(self.parameters, {"mode": str(self._mode)})
            self.configuration = replace(self.configuration, parameters=parameters)
        return ModeState(time, str(self._mode), str(before), reason)

    @staticmethod
    def _reason(decided: Step, faults: dict[Trigger, str]) -> str:
        trigger = decided.trigger
        return "" if trigger is None else f"{trigger}, {faults[trigger]}" if trigger in faults else str(trigger)

    def _events(self, estimate: Estimate | None, target: Target | None) -> list[Trigger]:
        """Triggers of this tick by the estimate and its control error."""
        if estimate is None:
            return [Trigger.STATE_LOST]
        triggers = [Trigger.ACQUIRED] if estimate.status == EstimateStatus.ACQUIRED else []
        if target is not None:
            dx, dy, dz = (estimate.relative_state[:3] - target.relative_state[:3]).tolist()
            square, tube = dx * dx + dy * dy + dz * dz, self.parameters.tube
            if square <= tube * tube:
                triggers.append(Trigger.TARGET_REACHED)
            elif not square <= (LEFT * tube) ** 2:  # true for NaN
                triggers.append(Trigger.TARGET_LEFT)
        return triggers

    def _report(self, time: int, active: list[ActiveResponse]) -> None:
        """Log responses that begin or end."""
        if active == self._active:
            return
        for each in active:
            if each not in self._active:
                self.log(time, EventKind.WARNING, str(each), each.subject or each.entry.monitor)
        for each in self._active:
            if each not in active:
                self.log(time, EventKind.WARNING, f"over: {each}", each.subject or each.entry.monitor)
        self._active = active

    def _health_report(self, time: int, notable: list[Verdict], active: list[ActiveResponse]) -> HealthReport:
        statuses = [
            MonitorStatus(each.monitor, each.subject, int(each.level), each.statistic, each.threshold)
            for each in notable
        ]
        isolated, axes, laws = list[str](), list[str](), list[str]()
        for each in active:
            if each.response is Response.ISOLATE_SENSOR and each.subject not in isolated:
                # The last sensor stays: without any the state would be lost.
                if len(isolated) + 1 < len(self.parameters.sensors):
                    isolated.append(each.subject)
            elif each.response is Response.ISOLATE_AXIS and each.subject not in axes:
                axes.append(each.subject)
            elif each.response is Response.SWITCH_LAW:
                laws += [law for law in each.entry.laws if law not in laws]
        return HealthReport(time, statuses, isolated, axes, laws)


def default_fault_table() -> str:
    """Markdown table of the default fault table."""
    subjects = {name: monitor.subjects(SupervisorParameters(ANY_ORBIT)) for name, monitor in MONITORS.items()}
    return table_of(parse(DEFAULT, subjects, tuple(sensors()), AXES))
