"""Every topic of a graph as it comes: bytes, stamped with simulated time, numbered by its publishers."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from time import monotonic

from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.reception import Information
from formation_gnc.flight.sources import SourceLock, Verdict
from formation_gnc.transport.identified import identities
from formation_gnc.transport.message_types import message_class
from formation_gnc.transport.qos import quality
from formation_gnc.transport.subscriptions import Subscriptions, first_stamp

Callback = Callable[[bytes, Information], None]
"""Takes a message's CDR bytes and what is known of it, with its `stamp` in ns."""


class RawTopics:
    """Subscriptions of a node to every topic that there is, those that appear later too.

    In a formation, topics have their names within it, and those of other formations are left out.

    Messages are stamped with simulated time: their own header's if they begin with one, the latest tick's
    otherwise.
    """

    def __init__(
        self, node: Node, open_topic: Callable[[str, str, bool], Callback], formation: str | None = None
    ) -> None:
        """Subscribe to nothing yet.

        Args:
            node: the one who subscribes.
            open_topic: given a topic, its type and whether late subscribers get what was said before,
                returns who takes its messages; raises ConfigurationError for a type that is not installed.
            formation: namespace of the formation; None for all topics, by their full names.
        """
        self._node, self._open, self._formation = node, open_topic, formation
        self._known: set[str] = set()
        self._unheard: set[str] = set()
        self._subscriptions: dict[str, Subscriptions] = {}
        self._clocks: list[SourceLock] = []
        self._time = 0

    def look(self) -> None:
        """Subscribe to the topics that have appeared since, and besides where a writer is not matched."""
        for lock in self._clocks:
            lock.succeeds(monotonic())
        for topic in list(self._unheard):
            self._subscribe_to_offers(topic)
        self._unheard.clear()
        for topic, (type_name, *_) in self._node.get_topic_names_and_types():
            if topic not in self._known:
                self._known.add(topic)
                try:
                    self._subscribe(topic, type_name)
                except ConfigurationError as error:
                    self._node.get_logger().warning(f"{topic} is not heard: {error}")

    def _subscribe(self, topic: str, type_name: str) -> None:
        name = self._name_of(topic, type_name)
        if name is None:
            return
        kind = message_class(type_name)
        qos = self._offered(topic)
        take = self._open(name, type_name, qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL)
        is_clock, lock = name == topics.CLOCK.name, SourceLock(partial(identities, self._node, topic))
        stamped = is_clock or "std_msgs/Header" in list(kind.get_fields_and_field_types().values())[:1]

        if is_clock:
            self._clocks.append(lock)

        def receive(data: bytes, about: Information) -> None:
            stamp = -1
            with suppress(ConfigurationError):
                stamp = first_stamp(data) if stamped else self._time
            if stamp < 0:  # of somebody else's making: ours has no time before 0
                stamp = self._time
            elif is_clock and lock.judge(about["publisher"], monotonic()) is Verdict.COUNTS:
                lock.choose(about["publisher"])
                self._time = stamp
            take(data, about | {"stamp": stamp})

        self._subscriptions[topic] = Subscriptions(self._node, kind, topic, receive)
        self._subscribe_to_offers(topic)

    def _name_of(self, topic: str, type_name: str) -> str | None:
        """Name of a topic within the formation; None for one of another."""
        formation = None if self._formation is None else topics.formation_of(topic, type_name)
        if formation is None:
            return topic
        return topic.removeprefix(formation) if formation == self._formation else None

    def _offered(self, topic: str) -> QoSProfile:
        """The most demanding quality of service that matches every present writer."""
        qos = quality()
        for offer in (each.qos_profile for each in self._node.get_publishers_info_by_topic(topic)):
            if offer.durability == QoSDurabilityPolicy.VOLATILE:
                qos.durability = QoSDurabilityPolicy.VOLATILE
            if offer.reliability == QoSReliabilityPolicy.BEST_EFFORT:
                qos.reliability = QoSReliabilityPolicy.BEST_EFFORT
        return qos

    def _subscribe_to_offers(self, topic: str) -> None:
        self._subscriptions[topic].add(self._offered(topic), lambda _: self._unheard.add(topic))
