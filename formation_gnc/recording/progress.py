"""Progress of a recording: the stamp up to which a run is recorded completely."""

from collections.abc import Callable
from functools import cache

from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH, commanding
from formation_gnc.recording.parameter_collection import PLANT
from formation_gnc.records import Event, EventKind

NONE = -1
"""Stamp before the first tick."""


class RecordingProgress:
    """Stamp up to which all messages of the plant and all answers of the deputies, or their misses, are recorded.

    Topics may be recorded in any order relative to one another. The last event of a run is stamped after the
    last tick; progress reaches it when everything else is recorded.
    """

    def __init__(self) -> None:
        """Start with nothing recorded."""
        self._answer_names = tuple(row.answer.name for row in GRAPH)
        self._commanding = frozenset(row.answer.name for row in commanding())
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
                stamps.add(self._recorded_of(deputy))
        recorded = min(stamps, default=NONE)
        return self._end if len(stamps) == 1 and self._end > recorded else recorded

    @property
    def lacking(self) -> list[str]:
        """Topics of which something is not recorded yet, though others have it of the same tick."""
        latest = max(self._plant.values(), default=NONE)
        found = [topic for topic, stamp in self._plant.items() if stamp < latest]
        for deputy in filter(None, map(topics.deputy_of, self._plant)):
            missed = self._missed.get(deputy, NONE)
            for name, stamp in self._answers_of(deputy).items():
                if self._counts(name, stamp, missed) and max(stamp, missed) < latest:
                    found.append(f"/{deputy}/{name}")
        return found

    def _recorded_of(self, deputy: str) -> int:
        """Stamp (ns) up to which a deputy has answered or missed.

        A module that the plant does not wait for may fall silent: it counts no more once a tick was missed since.
        """
        missed = self._missed.get(deputy, NONE)
        answers = self._answers_of(deputy).items()
        return max(min(stamp for name, stamp in answers if self._counts(name, stamp, missed)), missed)

    def _counts(self, name: str, stamp: int, missed: int) -> bool:
        """Whether an answer is waited for, given its latest stamp and that of the latest miss, ns."""
        return name in self._commanding or stamp >= missed

    def _answers_of(self, deputy: str) -> dict[str, int]:
        answers = self._answers.get(deputy)
        if answers is None:
            answers = self._answers[deputy] = dict.fromkeys(self._answer_names, NONE)
        return answers


@cache
def _parts(topic: str) -> tuple[str, str]:
    """Deputy and name of a topic."""
    return topics.deputy_of(topic), topic.rpartition("/")[2]
