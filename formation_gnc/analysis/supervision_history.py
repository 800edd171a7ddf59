"""Modes, detected faults and responses of one deputy of a recorded run."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from formation_gnc.analysis.timeline import Mark
from formation_gnc.recording.fields import Fields

SPANS = 300
"""Spans kept at most, of each kind."""

FAILED = 2
"""Level of a failure; the constant of MonitorStatus.msg."""


@dataclass
class Span:
    """Time over which something held."""

    name: str
    begin: float
    """s."""
    end: float = np.inf
    """s."""
    reason: str = ""


@dataclass
class SupervisionHistory:
    """What the supervisor of a deputy said, gathered batch by batch."""

    modes: list[Span] = field(default_factory=list)
    """Modes in force, one after the other."""
    detections: list[Span] = field(default_factory=list)
    """Monitors with their subjects, while these have failed."""
    responses: list[Span] = field(default_factory=list)
    """What modules did without."""
    injected: list[Mark] = field(default_factory=list)
    """Begin and end of each injected fault."""

    def add_modes(self, batch: Fields) -> None:
        """Take the next batch of modes; each holds from the tick after its stamp on."""
        times, modes = batch["time"], batch["mode"].astype(str)
        for row in _changes(modes, self.modes[-1].name if self.modes else ""):
            _end(self.modes[-1:], float(times[row]))
            _begin(self.modes, Span(modes[row], float(times[row]), reason=str(batch["reason"][row])))
        elements = list(batch.elements("restrictions"))
        if not elements and not any(span.end == np.inf for span in self.responses):
            return
        for row, time in enumerate(times.tolist()):
            self._hold(self.responses, time, _restrictions(batch, elements, row))

    def add_health(self, batch: Fields) -> None:
        """Take the next batch of reports of health, each of which holds until the next."""
        elements = list(batch.elements("statuses"))
        for row, time in enumerate(batch["time"].tolist()):
            self._hold(self.detections, time, _failures(batch, elements, row))

    def _hold(self, spans: list[Span], time: float, held: Iterable[tuple[str, str]]) -> None:
        """Begin and end spans such that those of these names, with reasons, hold from a time (s) on."""
        reasons = dict(held)
        for span in spans:
            if span.end == np.inf:
                if span.name in reasons:
                    del reasons[span.name]
                else:
                    span.end = time
        for name, reason in reasons.items():
            _begin(spans, Span(name, time, reason=reason))

    def finish(self, end: float) -> None:
        """End what holds at the end of the run, s."""
        for spans in (self.modes, self.detections, self.responses):
            _end(spans, end)

    @property
    def mode(self) -> str:
        """Mode at the end; empty without a supervisor."""
        return self.modes[-1].name if self.modes else ""


def _changes(modes: np.ndarray, before: str) -> Iterator[int]:
    """Rows at which the mode is another than the one before."""
    previous = np.concatenate(([before], modes[:-1]))
    return iter(np.flatnonzero(modes != previous).tolist())


def _begin(spans: list[Span], span: Span) -> None:
    """Add a span; of too many the last one is replaced."""
    if len(spans) == SPANS:
        spans.pop()
    spans.append(span)


def _end(spans: Iterable[Span], time: float) -> None:
    for span in spans:
        span.end = min(span.end, time)


def _restrictions(batch: Fields, elements: list[str], row: int) -> Iterator[tuple[str, str]]:
    for element in elements:
        if batch[f"{element}.kind"][row]:
            name = f"without {batch[f'{element}.kind'][row]} {batch[f'{element}.subject'][row]}"
            yield name.replace("without law", "law"), str(batch[f"{element}.reason"][row])


def _failures(batch: Fields, elements: list[str], row: int) -> Iterator[tuple[str, str]]:
    for element in elements:
        if batch[f"{element}.level"][row] == FAILED:
            yield f"{batch[f'{element}.monitor'][row]} {batch[f'{element}.subject'][row]}".strip(), ""
