"""All modules of one deputy in one process: the nodes of the graph, on one executor.

They publish what they publish as processes of their own, to the same bits; among themselves records go over the
intra-process bus.
"""

from formation_gnc.flight.graph import GRAPH
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.module_node import ModuleNode
from formation_gnc.transport.node import serve
from formation_gnc.transport.process import run


class Satellite:
    """The modules of a deputy."""

    def __init__(self) -> None:
        """Make the nodes in the table's order; all of them before any subscribes to another."""
        bus = IntraProcessBus()
        self.nodes = [ModuleNode(row, bus) for row in GRAPH]
        for node in self.nodes:
            node.subscribe_inputs()

    def spin(self) -> None:
        """Work until asked to stop."""
        serve(*self.nodes)
        self.nodes[0].spin()

    def destroy_node(self) -> None:
        """Leave, all of them."""
        for node in self.nodes:
            node.destroy_node()


def main() -> None:
    """Run the process."""
    run(Satellite)
