"""Executable of the display."""

from formation_gnc.transport.display_node import DisplayNode
from formation_gnc.transport.process import run


def main() -> None:
    """Run the node."""
    run(DisplayNode)
