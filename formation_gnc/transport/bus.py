"""From hand to hand: what parts in one process say to one another."""

from collections import deque
from collections.abc import Callable
from typing import Any


class IntraProcessBus:
    """Hands records from part to part inside one process, besides what is published."""

    def __init__(self) -> None:
        """Nobody speaks yet."""
        self._ears: dict[str, list[Callable[[Any], None]]] = {}
        self._waiting = deque[tuple[str, Any]]()

    def __contains__(self, topic: str) -> bool:
        """Whether a part in this process speaks on a topic."""
        return topic in self._ears

    def speak(self, topic: str) -> Callable[[Any], None]:
        """A function that hands a record on at the next `deliver`."""
        self._ears[topic] = []
        return lambda record: self._waiting.append((topic, record))

    def hear(self, topic: str, ear: Callable[[Any], None]) -> None:
        """Let `ear` have every record of a topic; who asks last hears first: the controller, who needs the
        estimate too, before guidance answers it."""
        self._ears[topic].insert(0, ear)

    def deliver(self) -> None:
        """Hand on what has been said since."""
        while self._waiting:
            topic, record = self._waiting.popleft()
            for ear in self._ears[topic]:
                ear(record)
