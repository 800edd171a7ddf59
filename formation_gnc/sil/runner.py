"""The in-process runner: the modules of the node graph, called one after the other."""

from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.graph import COMMAND, GRAPH, ModuleInstance
from formation_gnc.sil.scenario import Scenario
from formation_gnc.sil.simulation import Simulation, Sink


class Run:
    """A whole run without a node graph: the same records on the same topics, bit for bit."""

    def __init__(self, scenario: Scenario) -> None:
        """Build plant and modules; raises ConfigurationError for what cannot be flown."""
        self.simulation = Simulation(scenario.plant)
        self.plant = self.simulation.plant
        instances = (
            ModuleInstance(row, deputy, scenario.deputies[deputy][row.name])
            for row in GRAPH
            for deputy in scenario.plant.deputies
        )
        self.instances = {instance.node: instance for instance in instances}
        """By full node name, in the order in which they answer."""
        self._before: dict[str, Any] = {}
        """Records of the tick before, by topic."""
        self._commands = {deputy: COMMAND.of(deputy) for deputy in scenario.plant.deputies}

    @property
    def misses(self) -> int:
        """Deputies' ticks without an answer so far."""
        return self.simulation.misses

    def tick(self, sink: Sink) -> None:
        """Fly one tick and hand every record to `sink`."""
        records: dict[str, Any] = {}

        def publish(topic: str, record: Any) -> None:
            records[topic] = record
            sink(topic, record)

        self.simulation.open_tick(0.0, publish)
        for instance in self.instances.values():
            inputs = instance.collect(records, self._before)
            if inputs is not None:
                for topic, record in instance.respond(inputs):
                    publish(topic, record)
            if instance.module.events:
                for event in instance.take_events():
                    sink(topics.EVENTS.name, event)
        self._before = records
        for deputy, topic in self._commands.items():
            if topic in records:
                self.simulation.answer(deputy, records[topic])
        self.simulation.advance(sink)

    def fly(self, sink: Sink) -> None:
        """Fly to the end."""
        while not self.plant.finished:
            self.tick(sink)
