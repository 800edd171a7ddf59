"""History of a recorded run: read once, thinned while it is read, for bags of any length."""

from collections import Counter
from itertools import combinations

import numpy as np

from formation_gnc.analysis.deputy_history import HOUR, DeputyHistory, Handler, TickColumns
from formation_gnc.analysis.separation import Separation, minimum_separation
from formation_gnc.analysis.thinning import ThinnedByKey, TickSelection, points_of
from formation_gnc.analysis.timeline import Mark, Timeline, event_colours
from formation_gnc.analysis.trajectory import deputies_of, event_kinds, unseen_thrust
from formation_gnc.flight import topics
from formation_gnc.recording.fields import Fields
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EventKind, kind_name
from formation_gnc.types import Matrix, Vector

FAULT = kind_name(EventKind.FAULT)

EVENTS = 300
"""Events kept at most."""


class RunHistory:
    """Curves of a recorded run.

    Attributes:
        deputies: by name.
        events: the first EVENTS of the run.
        event_counts: of all events, by kind.
        distances: (N, 2) time (h) and distance (m), thinned, by pair of deputies.
        nearest: nearest approach over all ticks; None for a single deputy.
        tick: time between ticks, s.
        time: (N,) selected ticks with truth, h.
        chief: (N, 6) inertial states of the chief at `time`.

    Raises:
        BagError: the bag has no truth, or lacks a field.
    """

    @np.errstate(all="ignore")  # what a bag holds may be as large as a float
    def __init__(self, bag: Bag) -> None:
        """Read the bag once."""
        names = deputies_of(bag)
        self._selection, self._chief = TickSelection(bag, points_of(len(names))), TickColumns("chief_state")
        selection = self._selection
        self.tick = selection.tick_ns * 1e-9
        self.deputies = {
            name: DeputyHistory(index, name, selection, unseen_thrust(bag, name)) for index, name in enumerate(names)
        }
        self.events: list[Mark] = []
        self.event_counts: Counter[str] = Counter()
        self.nearest: Separation | None = None
        self._distances = ThinnedByKey[tuple[str, str]](2, selection.points)
        handlers = {
            topics.TRUTH.name: Handler(self._add_truth, ("chief_state", "deputies")),
            topics.EVENTS.name: Handler(self._add_events, ("kind", "node", "subject", "detail")),
        }
        for name, deputy in self.deputies.items():
            handlers |= {f"/{name}/{topic}": handler for topic, handler in deputy.handlers.items()}
        fields = {topic: handler.fields for topic, handler in handlers.items() if topic in bag.topics}
        for topic, batch in bag.batches(list(fields), fields=fields):
            handlers[topic].add(batch)
        for deputy in self.deputies.values():
            deputy.finish(bag.end_ns / 3.6e12)
        self.time: Vector = self._chief["stamp_ns"] / 3.6e12
        self.chief: Matrix = self._chief["chief_state"]
        self.distances: dict[tuple[str, str], Matrix] = self._distances.rows

    @property
    def timeline(self) -> Timeline:
        """All events, without the eclipses of a deputy."""
        return Timeline(self.events, [], event_colours(self.event_counts))

    def timeline_of(self, deputy: str) -> Timeline:
        """Eclipses of a deputy, events of its modules, and events of the run about it or about no deputy."""

        def concerns(mark: Mark) -> bool:
            owner = mark.node.split("/")[1:-1]
            if owner:
                return owner == [deputy]
            return mark.subject == deputy or mark.subject not in self.deputies

        events = [mark for mark in self.events if concerns(mark)]
        return Timeline(events, self.deputies[deputy].eclipses, event_colours(self.event_counts))

    def _add_truth(self, batch: Fields) -> None:
        self._chief.add(batch, self._selection(batch["stamp_ns"]))
        for deputy in self.deputies.values():
            deputy.add_truth(batch)
        names = list(self.deputies)
        positions = [batch[f"deputies.{index}.relative_state"][:, :3] for index in range(len(names))]
        nearest = minimum_separation(batch["time"], np.array(positions), names)
        if nearest is not None and (self.nearest is None or nearest.distance < self.nearest.distance):
            self.nearest = nearest
        for one, other in combinations(range(len(names)), 2):
            distance = np.linalg.norm(positions[one] - positions[other], axis=1)
            self._distances.add((names[one], names[other]), np.column_stack((batch["time"] / HOUR, distance)))

    def _add_events(self, batch: Fields) -> None:
        kinds = event_kinds(batch)
        self.event_counts.update(kinds)
        subjects = batch["subject"] if "subject" in batch else [""] * len(kinds)  # none in bags of 0.1.0
        rows = zip(batch["time"], kinds, batch["node"], subjects, batch["detail"], strict=True)
        marks = (Mark(float(time) / HOUR, kind, *map(str, texts)) for time, kind, *texts in rows)
        for mark in marks:
            if mark.kind == FAULT and mark.subject in self.deputies:
                injected = self.deputies[mark.subject].supervision.injected
                injected.extend([mark][: EVENTS - len(injected)])
            if len(self.events) < EVENTS:
                self.events.append(mark)
