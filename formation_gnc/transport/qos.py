"""The one quality of service that all topics have."""

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

from formation_gnc.flight.topics import QUEUE_DEPTH

LATEST = 1
"""Depth of a reader that answers tick by tick: what it did not answer in time is of no use any more."""


def quality(depth: int = QUEUE_DEPTH) -> QoSProfile:
    """Reliable, and kept for late joiners: a node started again finds the message it has to answer."""
    return QoSProfile(
        reliability=QoSReliabilityPolicy.RELIABLE,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL,
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
    )
