"""Modules that do not answer, and ticks that are missed."""

from collections import deque
from collections.abc import Sequence

from formation_gnc.supervision.held import HeldTime
from formation_gnc.supervision.monitor import Monitor, Observation, When
from formation_gnc.supervision.parameters import SupervisorParameters

SILENCE, TICKS = 60.0, 10
"""Time without an answer that is a failure, s, and at least so many ticks."""

WINDOW, MOST = 100, 10
"""Ticks of a window, and how many of them may be missed."""

MODULES = ("navigation", "guidance", "controller")


class Heartbeat(Monitor):
    """Time for which a module has not answered, by its records: the first one in the chain, which the others wait for.

    Assumes: a navigation without a state for a minute is as good as silent.
    Cannot see: an answer that is wrong.
    Delay: the bound.
    """

    name = "heartbeat"
    title = "modules that do not answer"
    test = "bound, a minute and ten ticks without a record"

    def prepare(self) -> None:
        """All answer."""
        self._held = {module: HeldTime() for module in MODULES}
        self._limit = max(SILENCE, TICKS * self.parameters.tick)

    @classmethod
    def subjects(cls, parameters: SupervisorParameters) -> Sequence[str]:
        """The modules."""
        return MODULES

    def feed(self, observation: Observation) -> None:
        """Look for the records of this tick."""
        is_excused = observation.measurement is None
        given = (observation.estimate, observation.target, observation.status)
        for module, record in zip(MODULES, given, strict=True):
            is_silent = record is None and not is_excused
            is_excused |= record is None
            self.judge(module, self._held[module].look(observation.time, is_silent) / self._limit, 0.5, 1.0)


class CycleSlips(Monitor):
    """Ticks of the last hundred for which there was nothing, since a node was late or the supervisor was not there.

    Cannot see: a node that is slow but in time.
    Delay: the missed ticks.
    """

    name = "cycle_slips"
    title = "ticks that were missed"
    test = f"bound, {MOST} of {WINDOW} ticks"
    when = When.GAP | When.RARE

    def prepare(self) -> None:
        """None missed."""
        self._slips: deque[tuple[int, int]] = deque()
        self._has_begun = False

    def feed(self, observation: Observation) -> None:
        """Count the gaps within the window."""
        tick = observation.time // self.parameters.tick_ns
        if observation.missed and self._has_begun:
            self._slips.append((tick, min(observation.missed, WINDOW)))
        self._has_begun = True
        while self._slips and self._slips[0][0] <= tick - WINDOW:
            self._slips.popleft()
        self.judge("", sum(missed for _, missed in self._slips) / MOST, 0.5, 1.0)
