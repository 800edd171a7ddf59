"""Last minutes of a run in memory, written on a trigger."""

from collections import deque

from formation_gnc.flight import topics
from formation_gnc.recording.writer import BagWriter


class Snapshot:
    """Keeps the messages of the last `duration` of simulated time, and writes them to a bag on a trigger.

    Every trigger starts a new file of the bag, with the messages since the last trigger that are still kept.
    A ``/clock`` that jumps back by more than `duration` is a new run, and discards the old one.
    """

    def __init__(self, bag: BagWriter, duration: float) -> None:
        """Keep `duration` s of simulated time for `bag`, which the caller closes."""
        self._bag, self._duration_ns = bag, round(duration * 1e9)
        self._kept: deque[tuple[str, bytes, int, int]] = deque()
        self._latest = 0

    def write(self, topic: str, data: bytes, stamp_ns: int, sequence: int) -> None:
        """Keep one message; arguments as in `BagWriter.write`."""
        if topic == topics.CLOCK.name and stamp_ns < self._latest - self._duration_ns:
            self._kept.clear()
            self._latest = stamp_ns
        self._kept.append((topic, data, stamp_ns, sequence))
        self._latest = max(self._latest, stamp_ns)
        while self._kept and self._is_expired(self._kept[0][2]):
            self._kept.popleft()

    def trigger(self) -> int:
        """Write and discard the kept messages; returns the number of those written."""
        self._bag.begin_file()
        count = 0
        while self._kept:
            topic, data, stamp_ns, sequence = self._kept.popleft()
            if not self._is_expired(stamp_ns):  # one may be, behind a newer one of another topic
                self._bag.write(topic, data, stamp_ns, sequence)
                count += 1
        self._bag.flush()
        return count

    def _is_expired(self, stamp_ns: int) -> bool:
        return stamp_ns <= self._latest - self._duration_ns
