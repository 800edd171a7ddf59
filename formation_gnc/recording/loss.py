"""What a log lacks, by the numbers that publishers give their messages."""

from collections.abc import Callable


class LossCounter:
    """Counts the messages of one topic that never came.

    Every publisher numbers its messages 1, 2, 3, ... and delivers in order, but a message does not say whose
    it is. So each is matched with a publisher whose last number is one less; one that has none follows a
    gap, or is the first that is heard of a publisher.
    """

    def __init__(self, publishers: Callable[[], int], from_the_first: bool) -> None:
        """Count from nothing.

        Args:
            publishers: how many the topic has just now; asked only where a number does not follow another.
            from_the_first: whether what a publisher said before it was heard at all is lost too.
        """
        self.lost = 0
        self._publishers, self._from_the_first = publishers, from_the_first
        self._last: list[int] = []

    def take(self, number: int) -> int:
        """Take a message's number; returns how many were lost before it."""
        last = self._last
        if len(last) == 1 and last[0] == number - 1:  # all but always
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
