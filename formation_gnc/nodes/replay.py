"""Executable of the replay."""

from formation_gnc.transport.node import CHECK_PERIOD
from formation_gnc.transport.process import run, stop_requested
from formation_gnc.transport.replay_node import ReplayNode


def play(node: ReplayNode) -> None:
    """Play to the end, or until a stop is requested."""
    node.spin(lambda: stop_requested() or node.check(), lambda: CHECK_PERIOD)


def main() -> None:
    """Run the node."""
    run(ReplayNode, play)
