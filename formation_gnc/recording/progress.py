"""Progress of a recording: the stamp up to which a run is recorded completely."""

from collections.abc import Callable
from functools import cache

from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH, commanding
from formation_gnc.recording.parameter_collection import PLANT
from formation_gnc.records import Event, EventKind

NONE = -1
"""Stamp before the first tick."""

LONGEST_TICK = 5.0
"""Wall time (s) without progress after which what is lacking does not just take its time."""


class RecordingProgress:
    """Stamp up to which all messages of the plant and all answers of the deputies, or their misses, are recorded.

    Topics may be recorded in any order relative to one another. The last event of a run is stamped after the
    last tick; progress reaches it when everything else is recorded.
    """

    def __init__(self) -> None:
        """Start with nothing recorded."""
        self._answer_names = tuple(row.answer.name for row in GRAPH)
        self._commanding = frozenset(row.answer.name for row in commanding())
        self._looked_at: tuple[int, float] | None = None
        """Stamp (ns) when it was last asked what is awaited, and the wall time (s) from which it has been that."""
        self.reset()

    def reset(self) -> None:
        """Start over, after a restart of the plant."""
        self._plant: dict[str, int] = {}
        self._answers: dict[str, dict[str, int]] = {}
        self._missed: dict[str, int] = {}
        self._end = NONE

    def concerns(self, topic: str) -> bool:
        """Whether progress depends on a topic."""
        name = topic.rpartition("/")[2]
        return topic in (topics.CLOCK.name, topics.TRUTH.name) or name in (topics.MEASUREMENT.name, *self._answer_names)

    def take(self, topic: str, stamp: int, publishers: Callable[[], int] = lambda: 1) -> None:
        """Take the stamp (ns) of a message of a topic that concerns progress.

        Time that runs backwards is a new run; where a topic has several publishers, it is another one's time.
        """
        deputy, name = _parts(topic)
        is_answer = name in self._answer_names
        latest, key = (self._answers_of(deputy), name) if is_answer else (self._plant, topic)
        if stamp < latest.get(key, NONE):
            if publishers() > 1:
                return
            if topic == topics.CLOCK.name:
                self.reset()
                latest = self._plant
        latest[key] = stamp

    def take_event(self, event: Event) -> None:
        """Take an event: a deputy has missed its tick, or the run has ended."""
        if event.node == PLANT and event.kind == EventKind.MISS:
            self._missed[event.subject] = event.time
        elif event.node == PLANT and event.kind == EventKind.END:
            self._end = event.time

    @property
    def stamp(self) -> int:
        """Stamp (ns) up to which everything is recorded; -1 for nothing."""
        stamps = set(self._plant.values())
        for topic in self._plant:
            deputy = topics.deputy_of(topic)
            if deputy:
                stamps.add(min(self._recorded_of(deputy).values()))
        recorded = min(stamps, default=NONE)
        return self._end if len(stamps) == 1 and self._end > recorded else recorded

    @property
    def lacking(self) -> list[str]:
        """Topics of which something is not recorded yet, though others have it of the same tick."""
        latest = max(self._plant.values(), default=NONE)
        found = [topic for topic, stamp in self._plant.items() if stamp < latest]
        for deputy in filter(None, map(topics.deputy_of, self._plant)):
            found += [f"/{deputy}/{name}" for name, stamp in self._recorded_of(deputy).items() if stamp < latest]
        return found

    def awaited(self, now: float) -> list[str]:
        """Topics that have held the recording up for long; called now and then, with the wall time (s)."""
        stamp, lacking = self.stamp, self.lacking
        if self._looked_at is None or stamp != self._looked_at[0] or not lacking:
            self._looked_at = stamp, now
        return lacking if now - self._looked_at[1] > LONGEST_TICK else []

    def _recorded_of(self, deputy: str) -> dict[str, int]:
        """Stamps (ns) up to which a deputy has answered or missed, by the names of the answers that count.

        A module that the plant does not wait for may fall silent: it counts no more once a tick was missed since.
        """
        missed = self._missed.get(deputy, NONE)
        answers = self._answers_of(deputy).items()
        return {name: max(stamp, missed) for name, stamp in answers if name in self._commanding or stamp >= missed}

    def _answers_of(self, deputy: str) -> dict[str, int]:
        answers = self._answers.get(deputy)
        if answers is None:
            answers = self._answers[deputy] = dict.fromkeys(self._answer_names, NONE)
        return answers


@cache
def _parts(topic: str) -> tuple[str, str]:
    """Deputy and name of a topic."""
    return topics.deputy_of(topic), topic.rpartition("/")[2]
