"""Responses to faults: from the failures of a tick to what is to be done, by the fault table."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from formation_gnc.mode_records import RestrictionKind
from formation_gnc.supervision.fault_table import FOREVER, Entry, Response
from formation_gnc.supervision.modes import Mode

RESTRICTIONS = {
    Response.ISOLATE_SENSOR: RestrictionKind.SENSOR,
    Response.ISOLATE_AXIS: RestrictionKind.AXIS,
    Response.SWITCH_LAW: RestrictionKind.LAW,
}
"""What modules do without, by response."""

BY_INNOVATIONS = frozenset({"innovation_bias", "innovation_drift"})
"""Monitors that accuse a sensor by what the others have made the state: with fewer than half of them left, these may be
right, or the model of the motion wrong."""

TOO_FEW = "too few sensors are left to say which are wrong"


@dataclass(frozen=True, slots=True)
class ActiveResponse:
    """A response in force."""

    entry: Entry
    subject: str
    response: Response
    """That of the entry, or `warn` in a mode in which the entry does not hold."""

    @property
    def cause(self) -> str:
        """Monitor and subject."""
        return f"{self.entry.monitor} {self.subject}".strip()

    def __str__(self) -> str:
        """One line for people."""
        words = [self.response, self.entry.mode or "", ", ".join(self.entry.laws)]
        what = " ".join(filter(None, words if self.response is self.entry.response else [self.response]))
        reason = "" if self.response is self.entry.response else f" ({self.entry.response} does not hold in this mode)"
        return f"{self.cause}: {what}{reason}"


@dataclass(slots=True)
class _Case:
    """A line of the table with a subject that has failed."""

    failed: int = 0
    """Ticks in a row."""
    clean: int = 0
    is_active: bool = False


class FaultResponses:
    """Persistence and return of every line of the table, by subject."""

    def __init__(self, table: Sequence[Entry]) -> None:
        """Without a fault."""
        self._table = table
        self._cases: dict[tuple[int, str], _Case] = {}

    def evaluate(self, failures: Iterable[tuple[str, str]], ticks: int, mode: Mode) -> list[ActiveResponse]:
        """Responses in force, in the order of the table.

        Args:
            failures: monitor and subject of every verdict that has failed at this tick.
            ticks: since the last evaluation.
            mode: in force.
        """
        failing = set()
        for monitor, subject in failures:
            for place, entry in enumerate(self._table):
                if entry.matches(monitor, subject):
                    failing.add((place, subject))
                    self._cases.setdefault((place, subject), _Case())
        if not self._cases:
            return []
        for key, case in list(self._cases.items()):
            entry = self._table[key[0]]
            if key in failing:
                case.failed, case.clean = case.failed + ticks, 0
                case.is_active |= case.failed >= entry.persistence
                continue
            case.failed, case.clean = 0, case.clean + ticks
            if not case.is_active or (entry.returns != FOREVER and case.clean >= entry.returns):
                del self._cases[key]
        active = []
        for (place, subject), case in sorted(self._cases.items(), key=lambda item: item[0]):
            if case.is_active:
                entry = self._table[place]
                holds = mode in entry.modes or mode is entry.mode
                active.append(ActiveResponse(entry, subject, entry.response if holds else Response.WARN))
        return active

    def release(self) -> None:
        """End the responses that a command ends, where the fault is over."""
        self._cases = {
            key: case for key, case in self._cases.items() if case.failed or self._table[key[0]].returns != FOREVER
        }
