"""Executable of the recorder."""

from formation_gnc.transport.process import run, stop_requested
from formation_gnc.transport.recorder_node import QUIET, RecorderNode
from formation_gnc.types import NANOSECONDS


def record(node: RecorderNode) -> None:
    """Record until a stop is requested and the queues are drained; raises OSError when the disk fails."""
    session = node.session
    try:
        node.spin(lambda: stop_requested() or session.failure is not None)
        node.spin(lambda: session.is_quiet() or session.failure is not None, lambda: QUIET)
    finally:
        session.close()
    stamp = max(0, session.progress.stamp) / NANOSECONDS
    node.get_logger().info(f"closed {session.bag.directory}: recorded to {stamp:g} s, {session.lost} messages lost")
    if session.failure is not None:
        raise session.failure


def main() -> None:
    """Run the node."""
    run(RecorderNode, record)
