"""The mode machine of a satellite: one table from a mode and a trigger to the next mode."""

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum

from formation_gnc.mode_records import Mode as Mode
from formation_gnc.types import Vector

LEFT = 1.5
"""Control error, over the tube, beyond which the target counts as left."""


class Trigger(StrEnum):
    """What may change a mode: a command, an event or a fault."""

    TO_STANDBY = "command standby"
    TO_ACQUIRE = "command acquire"
    TO_KEEP = "command keep"
    TO_RECONFIGURE = "command reconfigure"
    TO_AVOID = "command avoid"
    TO_SAFE = "command safe"
    ACQUIRED = "acquired"
    """The filter has started from an acquisition fix."""
    STATE_LOST = "state lost"
    """There is no estimate."""
    TARGET_REACHED = "target reached"
    """Control error within the tube."""
    TARGET_LEFT = "target left"
    """Control error beyond the tube."""
    RECONFIGURATION_BEGAN = "reconfiguration began"
    RECONFIGURATION_ENDED = "reconfiguration ended"
    SEPARATION_RESTORED = "separation restored"
    """Predicted separation above its limit again, after the evasion."""
    FAULT_STANDBY = "fault standby"
    FAULT_ACQUIRE = "fault acquire"
    FAULT_AVOID = "fault avoid"
    FAULT_SAFE = "fault safe"

    @property
    def is_command(self) -> bool:
        """Whether an operator gave it, who is told when it has no effect."""
        return self.startswith("command ")


COMMANDS = {Mode(trigger.removeprefix("command ")): trigger for trigger in Trigger if trigger.is_command}
"""Command of each mode."""

FAULTS = {Mode(trigger.removeprefix("fault ")): trigger for trigger in Trigger if trigger.startswith("fault ")}
"""Fault trigger of each mode that a fault may lead to."""

PRIORITY = (
    Trigger.FAULT_SAFE,
    Trigger.TO_SAFE,
    Trigger.FAULT_STANDBY,
    Trigger.FAULT_AVOID,
    Trigger.STATE_LOST,
    Trigger.TO_STANDBY,
    Trigger.TO_AVOID,
    Trigger.FAULT_ACQUIRE,
    Trigger.TO_ACQUIRE,
    Trigger.TO_KEEP,
    Trigger.TO_RECONFIGURE,
    Trigger.ACQUIRED,
    Trigger.RECONFIGURATION_BEGAN,
    Trigger.RECONFIGURATION_ENDED,
    Trigger.TARGET_LEFT,
    Trigger.SEPARATION_RESTORED,
    Trigger.TARGET_REACHED,
)
"""All triggers, safety first: of those with a row in a tick, the first one decides."""

_RANK = {trigger: rank for rank, trigger in enumerate(PRIORITY)}


def _rows(*rows: tuple[Mode, str, Mode]) -> dict[tuple[Mode, Trigger], Mode]:
    table: dict[tuple[Mode, Trigger], Mode] = {}
    for mode, triggers, target in rows:
        for trigger in triggers.split(", "):
            key = mode, Trigger(trigger)
            if key in table:
                raise ValueError(f"mode {mode}: {trigger} has two rows")
            table[key] = target
    return table


TRANSITIONS = _rows(
    (Mode.STANDBY, "command standby, fault standby", Mode.STANDBY),
    (Mode.STANDBY, "command acquire", Mode.ACQUIRE),
    (Mode.STANDBY, "command avoid", Mode.AVOID),
    (Mode.STANDBY, "command safe, fault safe", Mode.SAFE),
    (Mode.ACQUIRE, "command acquire, fault acquire", Mode.ACQUIRE),
    (Mode.ACQUIRE, "command standby, fault standby", Mode.STANDBY),
    (Mode.ACQUIRE, "target reached", Mode.KEEP),
    (Mode.ACQUIRE, "reconfiguration began", Mode.RECONFIGURE),
    (Mode.ACQUIRE, "command avoid, fault avoid", Mode.AVOID),
    (Mode.ACQUIRE, "command safe, fault safe", Mode.SAFE),
    (Mode.KEEP, "command keep", Mode.KEEP),
    (Mode.KEEP, "command standby, fault standby", Mode.STANDBY),
    (Mode.KEEP, "target left, state lost, acquired, command acquire, fault acquire", Mode.ACQUIRE),
    (Mode.KEEP, "reconfiguration began", Mode.RECONFIGURE),
    (Mode.KEEP, "command avoid, fault avoid", Mode.AVOID),
    (Mode.KEEP, "command safe, fault safe", Mode.SAFE),
    (Mode.RECONFIGURE, "command reconfigure", Mode.RECONFIGURE),
    (Mode.RECONFIGURE, "command standby, fault standby", Mode.STANDBY),
    (
        Mode.RECONFIGURE,
        "reconfiguration ended, state lost, acquired, command acquire, fault acquire",
        Mode.ACQUIRE,
    ),
    (Mode.RECONFIGURE, "command avoid, fault avoid", Mode.AVOID),
    (Mode.RECONFIGURE, "command safe, fault safe", Mode.SAFE),
    (Mode.AVOID, "command avoid, fault avoid", Mode.AVOID),
    (Mode.AVOID, "fault standby", Mode.STANDBY),
    (Mode.AVOID, "separation restored", Mode.ACQUIRE),
    (Mode.AVOID, "state lost, command safe, fault safe", Mode.SAFE),
    (Mode.SAFE, "command safe, fault safe, fault standby, fault avoid, fault acquire", Mode.SAFE),
    (Mode.SAFE, "command standby", Mode.STANDBY),
    (Mode.SAFE, "command acquire", Mode.ACQUIRE),
)
"""Next mode by mode and trigger. A row that keeps its mode overrules whatever comes after it in `PRIORITY`."""

_REACHED = "keep begins when the control error is within the tube; command acquire"
_GUIDED = "a reconfiguration begins with a new target; change the formation in guidance"
_EVADING = "the separation is below its limit; wait until it is restored, or command safe"

REFUSALS: dict[tuple[Mode, Trigger], str] = {
    (Mode.STANDBY, Trigger.TO_KEEP): _REACHED,
    (Mode.STANDBY, Trigger.TO_RECONFIGURE): _GUIDED,
    (Mode.ACQUIRE, Trigger.TO_KEEP): _REACHED,
    (Mode.ACQUIRE, Trigger.TO_RECONFIGURE): _GUIDED,
    (Mode.KEEP, Trigger.TO_RECONFIGURE): _GUIDED,
    (Mode.RECONFIGURE, Trigger.TO_KEEP): "the transfer is not over; command acquire to end it",
    (Mode.AVOID, Trigger.TO_STANDBY): _EVADING,
    (Mode.AVOID, Trigger.TO_ACQUIRE): _EVADING,
    (Mode.AVOID, Trigger.TO_KEEP): _EVADING,
    (Mode.AVOID, Trigger.TO_RECONFIGURE): _EVADING,
    (Mode.SAFE, Trigger.TO_KEEP): _REACHED,
    (Mode.SAFE, Trigger.TO_RECONFIGURE): "the orbit is safe without thrust; command acquire first",
    (Mode.SAFE, Trigger.TO_AVOID): "the orbit is safe without thrust; command acquire or standby",
}
"""Why a command is refused in a mode; every command has a row in one of both tables."""


@dataclass(frozen=True, slots=True)
class Step:
    """What the triggers of one tick lead to."""

    mode: Mode
    """From the next tick on."""
    trigger: Trigger | None = None
    """What decided; None when nothing did, and the mode stays."""
    refusals: tuple[tuple[Trigger, str], ...] = ()
    """Commands without effect, each with the reason."""


def step(mode: Mode, triggers: Collection[Trigger]) -> Step:
    """The next mode: at most one transition a tick, by the first trigger in `PRIORITY` that has a row.

    A trigger without a row in this mode has no effect; a command without effect is refused with its reason.
    """
    if not triggers:
        return Step(mode)
    ranked = sorted(set(triggers), key=_RANK.__getitem__)
    decisive = next((each for each in ranked if (mode, each) in TRANSITIONS), None)
    after = mode if decisive is None else TRANSITIONS[mode, decisive]
    refusals = []
    for each in ranked:
        if each.is_command and each is not decisive:
            reason = REFUSALS.get((mode, each), f"overruled by {decisive}, which leads to {after}")
            refusals.append((each, reason))
    return Step(after, decisive, tuple(refusals))


def by_error(error: Vector, tube: float) -> list[Trigger]:
    """Whether the target is reached or left, by the control error (3,) and the radius of the tube, m."""
    x, y, z = error.tolist()
    square = x * x + y * y + z * z
    if square <= tube * tube:
        return [Trigger.TARGET_REACHED]
    return [] if square <= (LEFT * tube) ** 2 else [Trigger.TARGET_LEFT]  # left also where it is NaN


def refusal(mode: Mode, wanted: Mode) -> str:
    """Why a command of a mode is refused; empty when it is allowed."""
    return REFUSALS.get((mode, COMMANDS[wanted]), "")


def diagram() -> str:
    """Mermaid diagram of the machine: an arrow from mode to mode has all triggers that lead from one to the other."""
    lines = ["stateDiagram-v2"]
    for mode in Mode:
        arrows: dict[Mode, list[Trigger]] = {}
        for (source, trigger), target in TRANSITIONS.items():
            if source is mode is not target:
                arrows.setdefault(target, []).append(trigger)
        lines += [f"  {mode} --> {target}: {', '.join(triggers)}" for target, triggers in arrows.items()]
    return "\n".join(["```mermaid", *lines, "```"])


def table() -> str:
    """Markdown table of the next mode by trigger (rows, by priority) and mode (columns); empty where it stays."""
    lines = ["| trigger | " + " | ".join(Mode) + " |", "|---|" + "---|" * len(Mode)]
    for trigger in PRIORITY:
        cells = [
            "refused" if (mode, trigger) in REFUSALS else str(TRANSITIONS.get((mode, trigger), "")) for mode in Mode
        ]
        lines.append(f"| {trigger} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def refusals_table() -> str:
    """Markdown table of refused commands with their reasons."""
    lines = ["| mode | command | refused because |", "|---|---|---|"]
    lines += [
        f"| {mode} | {trigger.removeprefix('command ')} | {reason} |" for (mode, trigger), reason in REFUSALS.items()
    ]
    return "\n".join(lines)
