"""The in-process runner: the objects of the node graph, called one after the other."""

from collections.abc import Callable, Mapping
from typing import Any

from formation_gnc.control.controller_manager import ControllerManager
from formation_gnc.flight.module import FlightModule
from formation_gnc.flight.synchronizer import StampSynchronizer
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.navigation.navigation_filter import NavigationFilter
from formation_gnc.plant.plant import Plant
from formation_gnc.records import Estimate, Event, EventKind, Thrust
from formation_gnc.sil.scenario import Scenario
from formation_gnc.types import Vector

Sink = Callable[[str, Any], None]
"""Takes a topic and the record that the node graph would publish on it."""


class Satellite:
    """Navigation, guidance and control of one deputy."""

    def __init__(self, name: str, scenario: Scenario) -> None:
        """Build the three parts from the scenario."""
        setup = scenario.deputies[name]
        self.name = name
        self.navigator = NavigationFilter(f"/{name}/navigation", setup.navigation)
        self.guide = Guidance(f"/{name}/guidance", setup.guidance)
        self.autopilot = ControllerManager(f"/{name}/controller", setup.controller)
        self._meeting = StampSynchronizer((name, *self.guide.neighbours), needed=1)
        self.parts: tuple[FlightModule[Any, Any], ...] = (self.navigator, self.guide, self.autopilot)

    def on_tick(self, estimates: Mapping[str, Estimate | None], sink: Sink) -> Thrust | None:
        """From the estimates of all deputies to thrust; none when there is nothing to act on."""
        estimate, records, thrust = estimates[self.name], None, None
        for name in (*self.guide.neighbours, self.name):
            if (each := estimates[name]) is not None:
                records = self._meeting.take(name, each)
        if estimate is not None:
            sink(f"/{self.name}/estimate", estimate)
        if estimate is not None and records is not None:
            target, separation = self.guide.on_tick(*records)
            thrust, status = self.autopilot.on_tick(estimate, target)
            for topic, record in (
                ("target", target),
                ("separation", separation),
                ("thrust", thrust),
                ("status", status),
            ):
                if record is not None:
                    sink(f"/{self.name}/{topic}", record)
        for part in self.parts:
            for event in part.take_events():
                sink("/events", event)
        return thrust


class Run:
    """A whole run without a node graph: the same records on the same topics, bit for bit."""

    def __init__(self, scenario: Scenario) -> None:
        """Build plant and satellites; raises ConfigurationError for what cannot be flown."""
        self.plant = Plant(scenario.plant)
        self.satellites = [Satellite(name, scenario) for name in scenario.plant.deputies]
        self.misses = 0

    def tick(self, sink: Sink) -> None:
        """Fly one tick and hand every record to `sink`."""
        measurements = self.plant.measure()
        sink("/truth", self.plant.truth())
        for name, measurement in measurements.items():
            sink(f"/{name}/measurement", measurement)
        estimates = {each.name: each.navigator.on_tick(measurements[each.name]) for each in self.satellites}
        forces: dict[str, Vector] = {}
        for satellite in self.satellites:
            thrust = satellite.on_tick(estimates, sink)
            if thrust is not None:
                forces[satellite.name] = thrust.force
        tick, time = self.plant.tick, self.plant.time
        for name in self.plant.step(forces):
            sink("/events", Event(time, tick, "/plant", EventKind.MISS, name, detail="no answer: no thrust"))
            self.misses += 1
        for event in self.plant.take_events():
            sink("/events", event)

    def fly(self, sink: Sink) -> None:
        """Fly to the end."""
        while not self.plant.finished:
            self.tick(sink)
        self.finish(sink)

    def finish(self, sink: Sink) -> None:
        """Say that all ticks are flown."""
        detail = f"{self.plant.tick} ticks flown, {self.misses} missed"
        sink("/events", Event(self.plant.time, self.plant.tick, "/plant", EventKind.END, detail=detail))
