"""The loop that serves nodes: messages of their inboxes at once, all else that ROS brings a little later."""

from select import POLLIN, poll
from time import monotonic
from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from formation_gnc.transport.identified import Inbox, inbox_of

try:
    from rclpy.experimental import EventsExecutor
except ImportError:  # missing in other builds of Jazzy; slower, same behaviour
    EventsExecutor = SingleThreadedExecutor

Executor: Any = EventsExecutor

MILLISECONDS = 1000.0
"""In a second."""

LOOK_PERIOD = 0.02
"""Wall time (s) after which timers and services have their turn at the latest."""


class Loop:
    """Serves nodes for all their life: a second loop would lose what the first one's executor had noticed."""

    def __init__(self, *nodes: Node, context: Context | None = None) -> None:
        """Serve these nodes, all of one context; None for the default one."""
        self._executor = Executor(context=context)
        self._poll = poll()
        self._inboxes: dict[int, Inbox] = {}
        for node in nodes:
            self._executor.add_node(node)
            inbox = inbox_of(node)
            self._inboxes[inbox.fileno()] = inbox
            self._poll.register(inbox, POLLIN)
        self._next_look = 0.0
        self._is_quiet = True
        """Whether no message has come since the last look."""

    def spin(self, duration: float) -> None:
        """Serve the nodes for a wall time (s)."""
        end = monotonic() + duration
        while True:
            now = monotonic()
            if now >= self._next_look:
                self._look()
                self._next_look = monotonic() + LOOK_PERIOD
            elif now >= end:
                return
            wait = min(end, self._next_look) - monotonic()
            for descriptor, _ in self._poll.poll(max(0.0, wait) * MILLISECONDS):
                self._inboxes[descriptor].receive()
                self._is_quiet = False

    def _look(self) -> None:
        """Give timers and services a turn, and in silence messages that nobody was told of: all may wait for one."""
        self._executor.spin_until_future_complete(Future(), timeout_sec=0.0)
        if self._is_quiet:
            for inbox in self._inboxes.values():
                inbox.look()
        self._is_quiet = True

    def remove(self, node: Node) -> None:
        """Serve a node no longer; after the last one the loop is over."""
        inbox = inbox_of(node)
        self._poll.unregister(inbox)
        del self._inboxes[inbox.fileno()]
        self._executor.remove_node(node)
        if not self._inboxes:
            self._executor.shutdown()
