"""The controller node: estimates and targets in, thrust out."""

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.records import NavigationState, Status, Target, Thrust
from formation_gnc.transport import topics
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.node import ModuleNode, run


class ControllerNode(ModuleNode[ControllerManager]):
    """Answers each pair of estimate and target with a thrust command and a status."""

    def __init__(self, bus: IntraProcessBus | None = None) -> None:
        """Listen and speak in the deputy's namespace."""
        super().__init__("controller", ControllerParameters, ControllerManager, bus)
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
