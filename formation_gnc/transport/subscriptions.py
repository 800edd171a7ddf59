"""Subscriptions that match every writer, whatever quality of service it offers."""

import struct
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSPolicyKind, QoSReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from formation_gnc.transport.qos import quality
from formation_gnc.types import NANOSECONDS

Information = dict[str, Any]
"""What is known of a message: `source_timestamp` (ns, system clock), `publication_sequence_number` and others."""


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
        node.create_subscription(kind, topic, with_information(callback), profile, raw=True, event_callbacks=events)

    def widen(incompatible: Any) -> None:
        is_best_effort = int(incompatible.last_policy_kind) == int(QoSPolicyKind.RELIABILITY)
        reliability = QoSReliabilityPolicy.BEST_EFFORT if is_best_effort else QoSReliabilityPolicy.RELIABLE
        add(QoSDurabilityPolicy.VOLATILE, reliability)

    add(QoSDurabilityPolicy.TRANSIENT_LOCAL, QoSReliabilityPolicy.RELIABLE)


def with_information(receive: Callable[[bytes, Information], object]) -> Callable[..., None]:
    """Take a message and what is known of it as two arguments or, from the EventsExecutor, as one pair."""

    @wraps(receive)  # rclpy looks at the signature to see whether it is wanted
    def call(*given: Any) -> None:
        data, about = given if len(given) == 2 else given[0]
        receive(data, about)

    return call


def names(endpoints: Iterable[TopicEndpointInfo]) -> list[str]:
    """Full names of the nodes that publish or subscribe."""
    return [f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in endpoints]


def first_stamp(data: bytes) -> int:
    """The stamp that a message begins with, in ns: after the four bytes of the encapsulation."""
    seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
    return int(seconds * NANOSECONDS + nanoseconds)
