"""Lost messages, counted by the sequence numbers of publishers."""


class LossCounter:
    """Counts the messages of one topic that never arrived.

    Every publisher numbers its messages 1, 2, 3, ... and delivers in order.
    """

    def __init__(self, from_the_first: bool) -> None:
        """Start with no publisher known.

        Args:
            from_the_first: whether messages before the first one received of a publisher count as lost.
        """
        self.lost = 0
        self._from_the_first = from_the_first
        self._last: dict[bytes, int] = {}
        """Number of the last message by publisher."""

    def take(self, publisher: bytes, number: int) -> int:
        """Take the number of a publisher's message; returns the number of messages lost before it."""
        last = self._last.get(publisher, 0 if self._from_the_first else number - 1)
        self._last[publisher] = number
        missing = max(0, number - 1 - last)
        self.lost += missing
        return missing
