"""The navigation node: measurements in, estimates out."""

from formation_gnc.navigation.navigation_filter import NavigationFilter, NavigationParameters
from formation_gnc.records import Estimate, Measurement
from formation_gnc.transport import topics
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.node import ModuleNode, run


class NavigationNode(ModuleNode[NavigationFilter]):
    """Answers each measurement with an estimate."""

    def __init__(self, bus: IntraProcessBus | None = None) -> None:
        """Listen and speak in the deputy's namespace."""
        super().__init__("navigation", NavigationParameters, NavigationFilter, bus)
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
