"""Responses to faults: from the failures of a tick to what is to be done, by the fault table."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from formation_gnc.mode_records import CHIEF, STATE, Restriction, RestrictionKind
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

    def withdraw(self, monitors: Collection[str]) -> None:
        """End the responses to some monitors: what they have said does not hold any more."""
        self._cases = {key: case for key, case in self._cases.items() if self._table[key[0]].monitor not in monitors}

    def release(self) -> None:
        """End the responses that a command ends, where the fault is over."""
        self._cases = {
            key: case for key, case in self._cases.items() if case.failed or self._table[key[0]].returns != FOREVER
        }


@dataclass(slots=True)
class Renewal:
    """A state that sensors contradict, begun anew from a fix: once, and again after every thrust."""

    is_due: bool = True
    """Whether it may be begun anew when it is contradicted."""
    is_awaited: bool = False
    """Whether a fix is."""
    is_over: bool = False
    """Whether it was: what was contradicted is the thrust told, or what has become of it."""
    cause: str = ""

    def begun(self, cause: str) -> Self:
        """The same while a fix is awaited."""
        return replace(self, is_due=False, is_awaited=True, cause=cause)

    @property
    def restriction(self) -> Restriction:
        """What tells navigation."""
        return Restriction(str(RestrictionKind.SENSOR), STATE, self.cause)


@dataclass(slots=True)
class Restricted:
    """What modules do without, and whether that leaves a state to steer by."""

    restrictions: list[Restriction] = field(default_factory=list)
    """Each once; what they did without already goes first."""
    blinded: str = ""
    """Why no sensor is left to trust; empty while one is."""
    is_contradicted: bool = False
    """Whether that is since innovations accuse too many of them: these, the state or the thrust told are wrong."""
    accused: tuple[str, ...] = ()
    """Axes whose force is told as another than commanded."""

    @property
    def sensors(self) -> set[str]:
        """Those that navigation does without."""
        return {each.subject for each in self.restrictions if each.kind == RestrictionKind.SENSOR}

    @property
    def axes(self) -> set[str]:
        """Those that modules do without."""
        return {each.subject for each in self.restrictions if each.kind == RestrictionKind.AXIS}


def restricted(
    active: Sequence[ActiveResponse], sensors: int, before: Sequence[Restriction], force_is_doubted: bool = False
) -> Restricted:
    """What modules do without.

    Args:
        active: responses in force.
        sensors: number of those in use.
        before: what they did without.
        force_is_doubted: whether the force told is wrong, and no reason to do without an axis.
    """
    out, left, known = Restricted(), sensors, set[tuple[RestrictionKind, str]]()
    order = {each.subject for each in before}
    for each in sorted(active, key=lambda each: each.subject not in order):
        kind = RESTRICTIONS.get(each.response)
        if kind is RestrictionKind.AXIS and each.subject not in out.accused:
            out.accused = (*out.accused, each.subject)
        if kind is None or (kind is RestrictionKind.AXIS and force_is_doubted):
            continue
        for subject in each.entry.laws or (each.subject,):
            if (kind, subject) in known:
                continue
            if kind is RestrictionKind.SENSOR and subject != CHIEF:
                by_others = each.entry.monitor in BY_INNOVATIONS
                if left - 1 < (0.5 * sensors if by_others else 1):
                    out.blinded = f"{each.cause}: {TOO_FEW if by_others else 'the last sensor'}"
                    out.is_contradicted |= by_others
                    continue
                left -= 1
            known.add((kind, subject))
            out.restrictions.append(Restriction(str(kind), subject, each.cause))
    return out
