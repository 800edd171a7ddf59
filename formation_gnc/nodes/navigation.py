"""The navigation node: measurements in, estimates out."""

from formation_gnc.interface import Estimate, Measurement
from formation_gnc.navigation.navigator import NavigationParameters, Navigator
from formation_gnc.nodes import topics
from formation_gnc.nodes.shell import PartNode, run
from formation_gnc.nodes.wires import Wires


class NavigationNode(PartNode[Navigator]):
    """Answers each measurement with an estimate."""

    def __init__(self, wires: Wires | None = None) -> None:
        """Listen and speak in the deputy's namespace."""
        super().__init__("navigation", NavigationParameters, Navigator, wires)
        self.publish = self.say(Estimate, topics.ESTIMATE)
        self.answer(self.on_tick, {topics.MEASUREMENT: Measurement})

    def on_tick(self, measurement: Measurement) -> None:
        """One tick; silent while there is no state to start from."""
        estimate = self.part.on_tick(measurement)
        if estimate is not None:
            self.publish(estimate)


def main() -> int:
    """Run the node."""
    return run(NavigationNode)
