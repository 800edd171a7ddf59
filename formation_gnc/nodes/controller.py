"""The controller node: estimates and targets in, thrust out."""

from formation_gnc.control.autopilot import Autopilot, ControllerParameters
from formation_gnc.interface import NavigationState, Status, Target, Thrust
from formation_gnc.nodes import topics
from formation_gnc.nodes.shell import PartNode, run
from formation_gnc.nodes.wires import Wires


class ControllerNode(PartNode[Autopilot]):
    """Answers each pair of estimate and target with a thrust command and a status."""

    def __init__(self, wires: Wires | None = None) -> None:
        """Listen and speak in the deputy's namespace."""
        super().__init__("controller", ControllerParameters, Autopilot, wires)
        self.publish_thrust = self.speak(Thrust, topics.THRUST)
        self.publish_status = self.speak(Status, topics.STATUS)
        self.answer(self.on_tick, {topics.ESTIMATE: NavigationState, topics.TARGET: Target})

    def on_tick(self, estimate: NavigationState, target: Target) -> None:
        """One tick; the plant waits for the thrust, so that goes first."""
        thrust, status = self.part.on_tick(estimate, target)
        self.publish_thrust(thrust)
        self.publish_status(status)


def main() -> int:
    """Run the node."""
    return run(ControllerNode)
