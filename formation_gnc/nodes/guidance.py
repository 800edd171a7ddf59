"""The guidance node: estimates in, targets out."""

from formation_gnc.guidance.guide import GuidanceParameters, Guide
from formation_gnc.interface import Estimate, Target
from formation_gnc.nodes import topics
from formation_gnc.nodes.shell import PartNode, run


class GuidanceNode(PartNode[Guide]):
    """Answers each estimate with a target."""

    def __init__(self) -> None:
        """Listen and speak in the deputy's namespace."""
        super().__init__("guidance", GuidanceParameters, Guide)
        self.publish = self.speak(Target, topics.TARGET)
        self.answer(self.on_tick, {topics.ESTIMATE: Estimate})

    def on_tick(self, estimate: Estimate) -> None:
        """One tick."""
        self.publish(self.part.on_tick(estimate))


def main() -> int:
    """Run the node."""
    return run(GuidanceNode)
