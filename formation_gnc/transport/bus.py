"""The intra-process bus: records between modules of one process, without serialisation."""

from collections import deque
from collections.abc import Callable
from typing import Any

Callback = Callable[[Any], None]


class IntraProcessBus:
    """Delivers records between modules of one process, besides what is published.

    Publishing only queues; `deliver` empties the queue. So a module's answer is complete before the next one
    starts, and a chain of modules does not nest.
    """

    def __init__(self) -> None:
        """No topics."""
        self._callbacks: dict[str, list[Callback]] = {}
        self._queue = deque[tuple[str, Any]]()

    def __contains__(self, topic: str) -> bool:
        """Whether a module of this process publishes a topic."""
        return topic in self._callbacks

    def advertise(self, topic: str) -> None:
        """Announce a topic that a module of this process publishes."""
        self._callbacks[topic] = []

    def publish(self, topic: str, record: Any) -> None:
        """Queue a record for the topic's subscribers."""
        if self._callbacks[topic]:
            self._queue.append((topic, record))

    def subscribe(self, topic: str, callback: Callback) -> None:
        """Call back with every record of a topic.

        Last subscribed, first called: the controller has the estimate before guidance answers it.
        """
        self._callbacks[topic].insert(0, callback)

    def deliver(self) -> None:
        """Deliver what is queued, and what that brings about."""
        while self._queue:
            topic, record = self._queue.popleft()
            for callback in self._callbacks[topic]:
                callback(record)
