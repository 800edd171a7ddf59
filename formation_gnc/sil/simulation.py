"""The plant's side of a run: opens ticks, takes the deputies' answers, and steps when the barrier allows."""

from collections.abc import Callable, Collection, Iterator
from math import inf
from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.barrier import Decision, TickBarrier
from formation_gnc.flight.graph import GRAPH, PLANT
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.plant.plant import Plant
from formation_gnc.records import Clock, Event, EventKind, Thrust
from formation_gnc.types import NANOSECONDS

Sink = Callable[[str, Any], None]
"""Takes a full topic name and the record that is published on it."""

RECORDER_LAG = topics.QUEUE_DEPTH // 4
"""Ticks that the plant may be ahead of the recorder: well inside what the queues hold."""


class Simulation:
    """Truth and tick barrier of one run.

    The graph's plant node and the in-process runner drive it alike: `open_tick`, `answer` for every deputy,
    and `advance_if_ready`, which steps the plant and opens the next tick. Times `now` are seconds of a
    monotonic wall clock; without deadlines and pace any constant will do.
    """

    def __init__(self, parameters: PlantParameters, deadline: float = inf) -> None:
        """Build the plant; raises ConfigurationError for what cannot be flown.

        deadline: wall time (s) that a deputy has for its answer.
        """
        self.parameters = parameters
        self.plant = Plant(parameters)
        pace = parameters.real_time_factor
        self.barrier = TickBarrier(
            parameters.deputies,
            deadline,
            RECORDER_LAG * parameters.tick_ns,
            parameters.tick / pace if pace else 0.0,
        )
        self.misses = 0
        self._measurement_topics = {name: topics.MEASUREMENT.of(name) for name in parameters.deputies}

    @property
    def has_begun(self) -> bool:
        """Whether the first tick is open."""
        return self.barrier.stamp >= 0

    def answers(self) -> Iterator[tuple[str, str]]:
        """Full names of the topics by which modules answer a tick, each with the module's name in the graph table."""
        for deputy in self.parameters.deputies:
            for row in GRAPH:
                yield row.answer.of(deputy), row.name

    def open_tick(self, now: float, publish: Sink) -> None:
        """Publish the plant's records of the current tick; measurements first, since all modules wait for them."""
        plant = self.plant
        self.barrier.open(plant.time, now)
        for name, measurement in plant.measure().items():
            publish(self._measurement_topics[name], measurement)
        publish(topics.TRUTH.name, plant.truth())
        publish(topics.CLOCK.name, Clock(plant.time))

    def answer(self, deputy: str, thrust: Thrust) -> bool:
        """Take a thrust command; returns whether it counts."""
        return self.barrier.answer(deputy, thrust.time, thrust.force)

    def advance_if_ready(self, now: float, publish: Sink, absent: Callable[[], Collection[str]] = tuple) -> Decision:
        """Fly the tick if it is over, and open the next; returns what the barrier said.

        absent: asked for the answers that nobody publishes as far as is known, when there is a miss to explain.
        """
        decision = self.barrier.decide(now)
        if decision.advance and not self.plant.finished:
            self.advance(publish, absent)
            if not self.plant.finished:
                self.open_tick(now, publish)
        return decision

    def advance(self, publish: Sink, absent: Callable[[], Collection[str]] = tuple) -> None:
        """Fly the tick with the answers there are; who gave none has missed it."""
        plant = self.plant
        tick, time = plant.tick, plant.time
        for name in plant.step(self.barrier.answers):
            reason = self.barrier.reason_of_miss(name, [topic for topic in absent() if topics.deputy_of(topic) == name])
            publish(topics.EVENTS.name, _event(time, tick, EventKind.MISS, f"{reason}: no thrust", name))
            self.misses += 1
        for event in plant.take_events():
            publish(topics.EVENTS.name, event)
        if plant.finished:
            detail = f"{plant.tick} ticks flown, {self.misses} missed"
            publish(topics.EVENTS.name, _event(plant.time, plant.tick, EventKind.END, detail))

    def warning(self, detail: str, subject: str = "") -> Event:
        """An event of the tick in flight that somebody should look at."""
        return _event(self.plant.time, self.plant.tick, EventKind.WARNING, detail, subject)

    def figures(self, elapsed: float) -> dict[str, float]:
        """Where the run is, after so many s of wall time since its first tick opened."""
        flown = self.plant.time / NANOSECONDS
        return {
            "tick": self.plant.tick,
            "ticks": self.parameters.ticks,
            "misses": self.misses,
            "wall_time": round(elapsed, 6),
            "speedup": round(flown / elapsed, 3) if elapsed > 0.0 else 0.0,
        }


def _event(time: int, tick: int, kind: EventKind, detail: str, subject: str = "") -> Event:
    return Event(time, tick, PLANT, kind, subject, [], detail)
