"""Subscriptions that match every writer, whatever quality of service it offers."""

import struct
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSPolicyKind, QoSReliabilityPolicy

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.reception import Information
from formation_gnc.transport.identified import IdentifiedSubscription
from formation_gnc.transport.qos import quality
from formation_gnc.types import NANOSECONDS

_STAMP = struct.Struct("<iI")
_BODY = 4  # bytes of the encapsulation


def subscribe_to_all(
    node: Node, kind: Any, topic: str, callback: Callable[[bytes, Information], object], depth: int
) -> None:
    """Call back with the CDR bytes of a topic's messages, with those kept for late readers where writers do so.

    A writer that is volatile or best effort, as those with the default profiles of ROS are, gets a subscription
    of its kind besides; what other writers publish is then received twice.
    """
    added = set[tuple[Any, Any]]()

    def add(durability: QoSDurabilityPolicy, reliability: QoSReliabilityPolicy) -> None:
        if (durability, reliability) in added:
            return
        added.add((durability, reliability))
        profile = quality(depth)
        profile.durability, profile.reliability = durability, reliability
        events = SubscriptionEventCallbacks(incompatible_qos=widen)
        IdentifiedSubscription(node, kind, topic, callback, profile, events)

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
