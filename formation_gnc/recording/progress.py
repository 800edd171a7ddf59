"""How far a recording has come: the stamp up to which everything of a run is on record."""

from formation_gnc.flight import topics
from formation_gnc.flight.graph import GRAPH

NONE = -1
"""Stamp before the first tick."""


class RecordingProgress:
    """Stamp up to which the plant's messages and every deputy's answers, or their misses, have come.

    Fed with the stamps of what comes, in any order between topics. A run's last event is stamped after the last
    tick; progress reaches it when everything else has come.
    """

    def __init__(self) -> None:
        """Nothing has come."""
        self._answer_names = tuple(row.answer.name for row in GRAPH)
        self.reset()

    def reset(self) -> None:
        """Start over: the plant was started again."""
        self._plant: dict[str, int] = {}
        self._answers: dict[str, dict[str, int]] = {}
        self._missed: dict[str, int] = {}
        self._event = NONE

    def concerns(self, topic: str) -> bool:
        """Whether progress depends on a topic, so that `take` is to be told its stamps."""
        name = topic.rpartition("/")[2]
        return topic in (topics.CLOCK.name, topics.TRUTH.name) or name in (topics.MEASUREMENT.name, *self._answer_names)

    def take(self, topic: str, stamp: int) -> None:
        """Note a message of a topic that progress depends on, stamped in ns."""
        deputy, name = topics.deputy_of(topic), topic.rpartition("/")[2]
        if name in self._answer_names:
            self._answers_of(deputy)[name] = stamp
            return
        if topic == topics.CLOCK.name and stamp < self._plant.get(topic, 0):
            self.reset()
        self._plant[topic] = stamp

    def take_event(self, stamp: int, missed_by: str = "") -> None:
        """Note an event, stamped in ns, and the deputy that missed its tick if it is a miss."""
        self._event = stamp
        if missed_by:
            self._missed[missed_by] = stamp

    @property
    def stamp(self) -> int:
        """Stamp (ns) up to which everything has come; -1 for nothing."""
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
