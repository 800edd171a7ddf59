"""Progress of a recording: the stamp up to which a run is recorded completely."""

from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH

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
        self.reset()

    def reset(self) -> None:
        """Start over, after a restart of the plant."""
        self._plant: dict[str, int] = {}
        self._answers: dict[str, dict[str, int]] = {}
        self._missed: dict[str, int] = {}
        self._event = NONE

    def concerns(self, topic: str) -> bool:
        """Whether progress depends on a topic."""
        name = topic.rpartition("/")[2]
        return topic in (topics.CLOCK.name, topics.TRUTH.name) or name in (topics.MEASUREMENT.name, *self._answer_names)

    def take(self, topic: str, stamp: int) -> None:
        """Take the stamp (ns) of a message of a topic that concerns progress."""
        deputy, name = topics.deputy_of(topic), topic.rpartition("/")[2]
        if name in self._answer_names:
            self._answers_of(deputy)[name] = stamp
            return
        if topic == topics.CLOCK.name and stamp < self._plant.get(topic, 0):
            self.reset()
        self._plant[topic] = stamp

    def take_event(self, stamp: int, missed_by: str = "") -> None:
        """Take the stamp (ns) of an event, and for a miss the deputy that missed its tick."""
        self._event = stamp
        if missed_by:
            self._missed[missed_by] = stamp

    @property
    def stamp(self) -> int:
        """Stamp (ns) up to which everything is recorded; -1 for nothing."""
        stamps = set(self._plant.values())
        for topic in self._plant:
            deputy = topics.deputy_of(topic)
            if deputy:
                stamps.add(max(min(self._answers_of(deputy).values()), self._missed.get(deputy, NONE)))
        recorded = min(stamps, default=NONE)
        # Only the end of the run is stamped after a tick.
        return self._event if len(stamps) == 1 and self._event > recorded else recorded

    def _answers_of(self, deputy: str) -> dict[str, int]:
        return self._answers.setdefault(deputy, dict.fromkeys(self._answer_names, NONE))
