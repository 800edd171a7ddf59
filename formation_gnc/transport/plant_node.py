"""The plant node: owns time, and lets a tick pass when every deputy has answered."""

from collections.abc import Callable, Mapping
from functools import partial
from time import monotonic
from typing import Any

from rclpy._rclpy_pybind11 import NodeNameNonExistentError

from formation_gnc.flight import topics
from formation_gnc.flight.graph import COMMAND, every_tick
from formation_gnc.flight.reception import Information
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.records import Clock, Measurement, Thrust, Truth
from formation_gnc.sil.plant_executive import PlantExecutive
from formation_gnc.sil.report import Report
from formation_gnc.transport.diagnostics import RUN, DiagnosticsPublisher
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.presence import Presence


class PlantNode(ConfiguredNode):
    """Carries the executive's records, reports and questions to the graph, and the deputies' answers to it."""

    def __init__(self) -> None:
        """Build the plant from the node's parameters."""
        super().__init__("plant", PlantParameters)
        deputies = self.values.deputies
        records = {topics.TRUTH.name: Truth, topics.CLOCK.name: Clock}
        records |= {topics.MEASUREMENT.of(name): Measurement for name in deputies}
        self._publish = {topic: self.publisher_of(record, topic) for topic, record in records.items()}
        self._publish[topics.EVENTS.name] = self.publish_event
        self._diagnostics = DiagnosticsPublisher(self, self.full_name("") or "/", RUN)
        recorded = {*self._publish, *(topic for name in deputies for topic in every_tick(name))}
        self._recorded_topics = set(map(self.full_name, recorded))
        self._presence = Presence(self)
        self.executive = PlantExecutive(self.values, self)
        for name in deputies:
            self.subscribe(Thrust, COMMAND.of(name), partial(self._on_thrust, name))
        self.subscribe(Clock, topics.PROGRESS.name, self._on_progress)

    def _on_thrust(self, deputy: str, thrust: Thrust, _: Information) -> bool:
        return self.executive.answer(deputy, thrust, monotonic())

    def _on_progress(self, progress: Clock, _: Information) -> None:
        self.executive.recorded(progress.time, monotonic())

    def stage_parameters(self, changes: Mapping[str, Any]) -> tuple[Any, Callable[[], None]]:
        """Validate a change in flight; it takes effect at the next tick."""
        plant = self.executive.simulation.plant
        staged = plant.stage(changes)
        return staged, lambda: plant.commit(staged)

    def publish(self, topic: str, record: Any) -> None:
        """Publish a record; events are logged too."""
        self._publish[topic](record)

    def simulated_time(self) -> int:
        """Stamp (ns) of the tick in flight."""
        return self.executive.simulation.plant.time

    def has_recorder(self) -> bool:
        """Whether a recorder reports progress, and its process lives."""
        return any(not self._presence.is_gone(name) for name in self.publishers_of(topics.PROGRESS.name))

    def recorder_listens(self) -> bool:
        """Whether the recorder, whatever its name, has subscribed to every topic of the run."""
        for recorder in self.get_publishers_info_by_topic(self.full_name(topics.PROGRESS.name)):
            try:
                subscribed = self.get_subscriber_names_and_types_by_node(recorder.node_name, recorder.node_namespace)
            except NodeNameNonExistentError:
                continue
            if dict(subscribed).keys() >= self._recorded_topics:
                return True
        return False

    def log(self, text: str) -> None:
        """Say something for people."""
        self.get_logger().info(text)

    def report(self, report: Report) -> None:
        """Publish where the run is."""
        self._diagnostics.publish_report(report, self.executive.simulation.plant.time)
