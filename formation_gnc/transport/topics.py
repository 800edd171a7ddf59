"""Names of nodes and topics, and the one quality of service they all have."""

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

DEPTH = 500
"""Messages that a writer keeps for who is late or slow, and that the recorder may lag behind.

DDS repairs what gets lost by 256 messages at a time: many times more, from all writers at once to a recorder
that joins on a busy machine, have held a flight up for most of a minute.
"""

CLOCK = "/clock"
TRUTH = "/truth"
EVENTS = "/events"
DIAGNOSTICS = "/diagnostics"
MARKERS = "/markers"
TRANSFORMS = "/transforms"
RECORDED = "/recorder/progress"
"""Stamp up to which the recorder has everything."""

MEASUREMENT = "measurement"
ESTIMATE = "estimate"
TARGET = "target"
THRUST = "thrust"
STATUS = "status"
SEPARATION = "separation"
"""Of a deputy in a fleet."""
TIMING = "timing"
PARTS = {"navigation": ESTIMATE, "guidance": TARGET, "controller": THRUST}
"""Nodes of every deputy, in its namespace, and what each answers with."""
DEPUTY_TOPICS = (MEASUREMENT, ESTIMATE, TARGET, THRUST, STATUS, TIMING)
"""Relative to the deputy's namespace."""


def quality(depth: int = DEPTH) -> QoSProfile:
    """Reliable, and kept for late joiners: a node started again finds the message it has to answer."""
    return QoSProfile(
        reliability=QoSReliabilityPolicy.RELIABLE,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL,
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
    )


LATEST = 1
"""Depth of a reader that answers tick by tick: what it did not answer in time has no use any more."""
