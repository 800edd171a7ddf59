"""Lost messages, counted by the sequence numbers of publishers."""

from collections.abc import Callable


class LossCounter:
    """Counts the messages of one topic that never arrived.

    Every publisher numbers its messages 1, 2, 3, ... and delivers in order, but a message does not carry its
    publisher. Each number is matched with a publisher whose last number is one less; a number without a match
    follows a gap, or is the first one received of a publisher.
    """

    def __init__(self, publishers: Callable[[], int], from_the_first: bool) -> None:
        """Start with no publisher known.

        Args:
            publishers: current number of publishers of the topic; called only where a number has no match.
            from_the_first: whether messages before the first one received of a publisher count as lost.
        """
        self.lost = 0
        self._publishers, self._from_the_first = publishers, from_the_first
        self._last: list[int] = []

    def take(self, number: int) -> int:
        """Take the number of a message; returns the number of messages lost before it."""
        last = self._last
        if len(last) == 1 and last[0] == number - 1:  # the common case
            last[0] = number
            return 0
        if number - 1 in last:
            last[last.index(number - 1)] = number
            return 0
        earlier = [each for each in last if each < number]
        if number == 1 or not earlier or len(last) < self._publishers():
            last.append(number)
            missing = number - 1 if self._from_the_first else 0
        else:
            before = max(earlier)
            last[last.index(before)] = number
            missing = number - 1 - before
        self.lost += missing
        return missing
