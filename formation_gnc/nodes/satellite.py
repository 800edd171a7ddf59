"""All parts of one deputy in one process: the nodes of the graph, on one executor.

They publish what they publish as processes of their own, to the same bits. What they say to one another goes
from hand to hand.
"""

from formation_gnc.nodes.controller import ControllerNode
from formation_gnc.nodes.guidance import GuidanceNode
from formation_gnc.nodes.navigation import NavigationNode
from formation_gnc.nodes.shell import run, serve
from formation_gnc.nodes.wires import Wires


class Satellite:
    """Navigation, guidance and controller of a deputy."""

    def __init__(self) -> None:
        """Make the nodes, who speaks before who listens."""
        wires = Wires()
        self.nodes = NavigationNode(wires), GuidanceNode(wires), ControllerNode(wires)

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
