"""Subscriptions that match every writer, whatever quality of service it offers."""

import struct
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSPolicyKind, QoSProfile, QoSReliabilityPolicy

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.reception import Information
from formation_gnc.transport.identified import IdentifiedSubscription
from formation_gnc.transport.qos import quality
from formation_gnc.types import NANOSECONDS

_STAMP = struct.Struct("<iI")
_BODY = 4  # bytes of the encapsulation


class Subscriptions:
    """Subscriptions of a node to a topic that together match its writers, whatever quality of service each offers.

    A message comes once: a later subscription takes those of writers that no earlier one matches.
    """

    def __init__(self, node: Node, kind: Any, topic: str, callback: Callable[[bytes, Information], object]) -> None:
        """Subscribe to nothing yet; `callback` takes the CDR bytes of messages of class `kind`."""
        self._node, self._kind, self._topic, self._callback = node, kind, topic, callback
        self._profiles: list[QoSProfile] = []

    def add(self, profile: QoSProfile, incompatible: Callable[[Any], None]) -> None:
        """Subscribe with a profile, unless that was done; `incompatible` is called at a writer it does not match."""
        wanted = profile.durability, profile.reliability
        if wanted in [(each.durability, each.reliability) for each in self._profiles]:
            return
        callback = self._unmatched(list(self._profiles)) if self._profiles else self._callback
        self._profiles.append(profile)
        events = SubscriptionEventCallbacks(incompatible_qos=incompatible)
        IdentifiedSubscription(self._node, self._kind, self._topic, callback, profile, events)

    def _unmatched(self, earlier: list[QoSProfile]) -> Callable[[bytes, Information], object]:
        """A callback for the messages of writers that match none of earlier profiles."""
        matched: dict[bytes, bool] = {}

        def take(data: bytes, about: Information) -> None:
            publisher = about["publisher"]
            if publisher not in matched:
                for each in self._node.get_publishers_info_by_topic(self._topic):
                    offer = each.qos_profile
                    matched[bytes(each.endpoint_gid)] = any(_matches(offer, profile) for profile in earlier)
            if not matched.get(publisher, False):
                self._callback(data, about)

        return take


def _matches(offer: QoSProfile, profile: QoSProfile) -> bool:
    """Whether a writer that offers a profile is heard by a reader with another."""
    lasts = profile.durability == QoSDurabilityPolicy.VOLATILE or offer.durability == profile.durability
    arrives = profile.reliability == QoSReliabilityPolicy.BEST_EFFORT or offer.reliability == profile.reliability
    return bool(lasts and arrives)


def subscribe_to_all(
    node: Node, kind: Any, topic: str, callback: Callable[[bytes, Information], object], depth: int
) -> None:
    """Call back with the CDR bytes of a topic's messages, with those kept for late readers where writers do so.

    A writer that is volatile or best effort, as those with the default profiles of ROS are, gets a subscription
    of its kind besides.
    """
    subscriptions = Subscriptions(node, kind, topic, callback)

    def add(durability: QoSDurabilityPolicy, reliability: QoSReliabilityPolicy) -> None:
        profile = quality(depth)
        profile.durability, profile.reliability = durability, reliability
        subscriptions.add(profile, widen)

    def widen(incompatible: Any) -> None:
        is_best_effort = int(incompatible.last_policy_kind) == int(QoSPolicyKind.RELIABILITY)
        reliability = QoSReliabilityPolicy.BEST_EFFORT if is_best_effort else QoSReliabilityPolicy.RELIABLE
        add(QoSDurabilityPolicy.VOLATILE, reliability)

    add(QoSDurabilityPolicy.TRANSIENT_LOCAL, QoSReliabilityPolicy.RELIABLE)


def first_stamp(data: bytes) -> int:
    """The stamp that a message begins with, in ns; raises ConfigurationError for one that is too short for it."""
    try:
        seconds, nanoseconds = _STAMP.unpack_from(data, _BODY)
    except struct.error:
        raise ConfigurationError(f"{len(data)} bytes are too few for a stamp") from None
    return int(seconds * NANOSECONDS + nanoseconds)
