"""All parts of one deputy in one process: the nodes of the graph, on one executor.

They publish what they publish as processes of their own, to the same bits. What they say to one another goes
from hand to hand.
"""

from formation_gnc.nodes.controller import ControllerNode
from formation_gnc.nodes.guidance import GuidanceNode
from formation_gnc.nodes.navigation import NavigationNode
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.node import run, serve


class Satellite:
    """Navigation, guidance and controller of a deputy."""

    def __init__(self) -> None:
        """Make the nodes, who speaks before who listens."""
        bus = IntraProcessBus()
        self.nodes = NavigationNode(bus), GuidanceNode(bus), ControllerNode(bus)

    def spin(self) -> None:
        """Work until asked to stop."""
        serve(*self.nodes)
        self.nodes[0].spin()

    def destroy_node(self) -> None:
        """Leave, all of them."""
        for node in self.nodes:
            node.destroy_node()


def main() -> int:
    """Run the process."""
    return run(Satellite, Satellite.spin)
