"""The guidance node: estimates in, targets out; in a fleet, predicted separations too."""

from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.records import NavigationState, Separation, Target
from formation_gnc.transport import topics
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.node import ModuleNode, run


class GuidanceNode(ModuleNode[Guidance]):
    """Answers each estimate with a target."""

    def __init__(self, bus: IntraProcessBus | None = None) -> None:
        """Listen and speak in the deputy's namespace, and listen to the others of a fleet."""
        super().__init__("guidance", GuidanceParameters, Guidance, bus)
        self.publish = self.say(Target, topics.TARGET)
        others = {f"/{name}/{topics.ESTIMATE}": NavigationState for name in self.part.neighbours}
        self.answer(self.on_tick, {topics.ESTIMATE: NavigationState}, others)
        if others:
            self.publish_separation = self.speak(Separation, topics.SEPARATION)

    def on_tick(self, estimate: NavigationState, *others: NavigationState | None) -> None:
        """One tick; now and then with a look at how near the others will come."""
        target, separation = self.part.on_tick(estimate, *others)
        self.publish(target)
        if separation is not None:
            self.publish_separation(separation)


def main() -> int:
    """Run the node."""
    return run(GuidanceNode)
