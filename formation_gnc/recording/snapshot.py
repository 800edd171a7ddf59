"""The last minutes of a run in memory, written when asked for."""

from collections import deque

from formation_gnc.flight import topics
from formation_gnc.recording.writer import BagWriter


class Snapshot:
    """Keeps the messages of the last stretch of simulated time, and writes them to a bag on a trigger.

    Every trigger fills a file of its own in the bag with what came since the last one, as far as it is kept.
    ``/clock`` running back by more than that stretch begins a new run: the old one is forgotten.
    """

    def __init__(self, bag: BagWriter, duration: float) -> None:
        """Keep `duration` s of simulated time for `bag`, which is closed by the one who made it."""
        self._bag, self._duration_ns = bag, round(duration * 1e9)
        self._kept: deque[tuple[str, bytes, int, int]] = deque()
        self._latest = 0

    def write(self, topic: str, data: bytes, stamp_ns: int, sequence: int) -> None:
        """Keep one message; takes what `BagWriter.write` takes."""
        if topic == topics.CLOCK.name and stamp_ns < self._latest - self._duration_ns:
            self._kept.clear()
            self._latest = stamp_ns
        self._kept.append((topic, data, stamp_ns, sequence))
        self._latest = max(self._latest, stamp_ns)
        while self._kept and self._is_over(self._kept[0][2]):
            self._kept.popleft()

    def trigger(self) -> int:
        """Write what is kept, and keep nothing any more; returns the number of messages written."""
        self._bag.begin_file()
        count = 0
        while self._kept:
            topic, data, stamp_ns, sequence = self._kept.popleft()
            if not self._is_over(stamp_ns):  # as one may be that came after a younger one of another topic
                self._bag.write(topic, data, stamp_ns, sequence)
                count += 1
        self._bag.flush()
        return count

    def _is_over(self, stamp_ns: int) -> bool:
        return stamp_ns <= self._latest - self._duration_ns
