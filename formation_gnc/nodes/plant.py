"""Executable of the plant."""

from time import monotonic

from formation_gnc.transport.plant_node import PlantNode
from formation_gnc.transport.process import run, stop_requested


def fly(node: PlantNode) -> None:
    """Fly the run to its end, and see the recorder through."""
    executive = node.executive
    node.spin(lambda: stop_requested() or executive.check(monotonic()), lambda: executive.period(monotonic()))
    node.spin(lambda: stop_requested() or executive.recorder_is_done(monotonic()))
    figures = executive.simulation.figures(0.0)
    how = "finished" if executive.finished else "stopped"
    node.log(f"{how}: {figures['tick']} of {figures['ticks']} ticks flown, {figures['misses']} missed")


def main() -> None:
    """Run the node."""
    run(PlantNode, fly)
