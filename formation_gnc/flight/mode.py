"""The mode in force, as the modules that obey it keep it."""

import numpy as np

from formation_gnc.mode_records import NO_FORCE, Mode, ModeState, RestrictionKind
from formation_gnc.types import Vector


class ModeInForce:
    """The last mode that the supervisor has said: it stands while the supervisor is silent.

    Before it has said one, a module flies as in a mode that keeps the formation, without restrictions.
    """

    def __init__(self) -> None:
        """Nothing has been said."""
        self._state: ModeState | None = None
        self.is_silent = False
        """Whether the supervisor has said a mode before, and none for this tick."""

    def take(self, state: ModeState | None) -> bool:
        """Take the mode for a tick, None for none; returns whether mode, restrictions or the silence changed."""
        before, was_silent = self._state, self.is_silent
        if state is None:
            self.is_silent = before is not None
            return self.is_silent != was_silent
        self._state, self.is_silent = state, False
        if before is None:
            return True
        return was_silent or state.mode != before.mode or state.restrictions != before.restrictions

    @property
    def name(self) -> str:
        """Its name; empty before one was said."""
        return "" if self._state is None else self._state.mode

    @property
    def evasion(self) -> Vector | None:
        """Force (3,) to hold in place of the law's, Hill frame, N; None in modes in which the law flies.

        Without thrust where the mode only stands: its plan goes on elsewhere.
        """
        state = self._state
        if state is None or state.mode not in _WITHOUT_LAW:
            return None
        is_flown = not self.is_silent and state.mode != Mode.STANDBY and np.isfinite(state.force).all()
        return state.force if is_flown else NO_FORCE

    def without(self, kind: RestrictionKind) -> tuple[str, ...]:
        """What a module does without, of a kind, in the supervisor's order."""
        restrictions = self._state.restrictions if self._state else ()
        return tuple(each.subject for each in restrictions if each.kind == kind)


_WITHOUT_LAW = frozenset({Mode.STANDBY, Mode.AVOID, Mode.SAFE})
