"""The plant node: owns time, and lets a tick pass when every deputy has answered."""

from collections.abc import Iterator
from functools import partial
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy._rclpy_pybind11 import NodeNameNonExistentError
from rosgraph_msgs.msg import Clock

from formation_gnc.plant.plant import Plant, PlantParameters
from formation_gnc.records import Event, EventKind, Measurement, Thrust, Truth
from formation_gnc.transport import topics
from formation_gnc.transport.conversion import codec
from formation_gnc.transport.node import ConfiguredNode, asked_to_stop, run
from formation_gnc.types import NANOSECONDS, Vector

RECORDER_LAG = topics.DEPTH // 4
"""Ticks that the plant may be ahead of the recorder: well inside what the queues hold."""

CHECK_PERIOD = 0.05
"""Wall time (s) between looks at deadlines, at the recorder and at who is there."""

LONGEST_LOOK = 10.0 * CHECK_PERIOD
"""Wall time (s) between two such looks beyond which the plant has been held up."""

REPORT_PERIOD = 0.5
"""Wall time (s) between reports on `/diagnostics`."""


class PlantNode(ConfiguredNode):
    """Publishes a tick, gathers the thrust of its stamp, steps, and so on to the end of the run.

    The run starts when every deputy's nodes are there, and then a deputy has `deadline` seconds of wall time
    for each answer, from its first one on: after that it gets no thrust for the tick. The plant never runs
    further ahead of a recorder than queues hold.
    """

    def __init__(self) -> None:
        """Build the plant from the node's parameters."""
        super().__init__("plant", PlantParameters)
        self.plant = Plant(self.values)
        self._measurement = {
            name: self.speak(Measurement, f"/{name}/{topics.MEASUREMENT}") for name in self.values.deputies
        }
        self._truth = self.speak(Truth, topics.TRUTH)
        self._events = self.speak(Event, topics.EVENTS)
        self._clock = Clock()
        self._tell_time = self.create_publisher(Clock, topics.CLOCK, topics.quality())
        self._diagnostics = self.create_publisher(DiagnosticArray, topics.DIAGNOSTICS, topics.quality())
        self._read_thrust = codec(Thrust).decode
        for name in self.values.deputies:
            self.listen(Thrust, f"/{name}/{topics.THRUST}", partial(self._on_thrust, name))
        self.create_subscription(Clock, topics.RECORDED, self._on_recorded, topics.quality(topics.LATEST))
        self._forces: dict[str, Vector] = {}
        self._awaited: set[str] = set()
        self._answered_before: set[str] = set()
        self._flying = False
        self._recorded: int | None = None
        self._recorder_is_there = False
        self._recorder_lag = RECORDER_LAG * self.values.tick_ns
        self._misses = 0
        self._started = self._tick_started = self._reported = self._looked = monotonic()
        self._said = ""

    def check(self) -> bool:
        """Do what no message triggers: start, deadlines, pace, a recorder that lags, reports.

        Returns:
            Whether all ticks are flown.
        """
        now = monotonic()
        # Time in which the plant itself got no processor is not held against the deputies.
        self._tick_started += max(0.0, now - self._looked - LONGEST_LOOK)
        self._looked = now
        if not self._flying:
            missing = ", ".join(self._missing())
            self._say(f"waiting for {missing}" if missing else "flying")
            if missing:
                self._report(self._said)
            else:
                self._flying = True
                self._started = monotonic()
                self._publish_tick()
            return False
        if self.plant.finished:
            return True
        self._recorder_is_there = self.count_publishers(topics.RECORDED) > 0
        late = sorted(self._awaited & self._answered_before)
        if late and now - self._tick_started > self.values.deadline:
            self._awaited -= set(late)
        elif self._awaited and now - self._tick_started > self.values.deadline:
            self._say(f"waiting for the first answer of {', '.join(sorted(self._awaited))}")
        elif self._recorder_lags() and now - self._tick_started > self.values.deadline:
            self._say("waiting for /recorder, which lags behind")
        self._advance_if_ready()
        if now - self._reported > REPORT_PERIOD and not self.plant.finished:
            self._report("flying")
        return self.plant.finished

    def _on_thrust(self, name: str, data: bytes) -> None:
        thrust = self._read_thrust(data)
        if name in self._awaited and thrust.time == self.plant.time:
            self._awaited.discard(name)
            self._answered_before.add(name)
            self._forces[name] = thrust.force
            self._advance_if_ready()

    def _advance_if_ready(self) -> None:
        """Fly the tick if all have answered, the recorder keeps up and it is time."""
        plant = self.plant
        if self._awaited or plant.finished or self._recorder_lags() or self._wait_for_pace() > 0.0:
            return
        tick, time = plant.tick, plant.time
        for name in plant.step(self._forces):
            detail = f"{self._reason_of_miss(name)}: no thrust"
            miss = Event(time, tick, self.get_fully_qualified_name(), EventKind.MISS, name, detail=detail)
            self.get_logger().warning(str(miss))
            self._events(miss)
            self._misses += 1
        for event in plant.take_events():
            self.get_logger().info(str(event))
            self._events(event)
        if plant.finished:
            detail = f"{plant.tick} ticks flown, {self._misses} missed"
            self._events(Event(plant.time, plant.tick, self.get_fully_qualified_name(), EventKind.END, detail=detail))
            self._report("finished")
        else:
            self._publish_tick()

    def _recorder_lags(self) -> bool:
        return self._recorder_is_there and self.plant.time > (self._recorded or 0) + self._recorder_lag

    def _reason_of_miss(self, name: str) -> str:
        if name in self._forces:
            return f"commanded {self._forces[name].tolist()} N"
        absent = [node for node in self._missing() if node.startswith(f"/{name}/")]
        where = f" ({', '.join(absent)} not there)" if absent else ""  # a killed node is missed by DDS only later
        return f"did not answer within {self.values.deadline:g} s{where}"

    def _publish_tick(self) -> None:
        self._forces = {}
        self._awaited.update(self.values.deputies)
        self._tick_started = monotonic()
        for name, measurement in self.plant.measure().items():  # first, since everybody waits for them
            self._measurement[name](measurement)
        self._truth(self.plant.truth())
        self._clock.clock.sec, self._clock.clock.nanosec = divmod(self.plant.time, NANOSECONDS)
        self._tell_time.publish(self._clock)

    def _on_recorded(self, message: Clock) -> None:
        self._recorded = message.clock.sec * NANOSECONDS + message.clock.nanosec
        if self._flying:
            self._advance_if_ready()

    def wait_for_recorder(self) -> bool:
        """Whether a recorder is there that has not got all to the end yet."""
        return self.count_publishers(topics.RECORDED) > 0 and (
            self._recorded is None or self._recorded < self.plant.time
        )

    def _wait_for_pace(self) -> float:
        """Wall time (s) until the tick may end at the real-time factor."""
        if self.values.real_time_factor == 0.0:
            return 0.0
        due = self._started + (self.plant.tick + 1) * self.values.tick / self.values.real_time_factor
        return float(due - monotonic())

    @property
    def period(self) -> float:
        """Wall time (s) until the next check."""
        pace = self._wait_for_pace() if self._flying and not self._awaited else 0.0
        return min(CHECK_PERIOD, pace) if pace > 0.0 else CHECK_PERIOD

    def _missing(self) -> Iterator[str]:
        """Full names of the nodes the run still waits for."""
        there = {f"{namespace.rstrip('/')}/{name}" for name, namespace in self.get_node_names_and_namespaces()}
        for deputy in self.values.deputies:
            for part in topics.PARTS:
                if f"/{deputy}/{part}" not in there:
                    yield f"/{deputy}/{part}"
        if self.values.wait_for_recorder and not self._recorder_listens():
            yield "/recorder"

    def _recorder_listens(self) -> bool:
        """Whether a recorder has subscribed to every topic of the run, and knows all parameters."""
        if self._recorded is None:
            return False
        try:
            heard = dict(self.get_subscriber_names_and_types_by_node("recorder", "/"))
        except NodeNameNonExistentError:
            return False
        names = [f"/{deputy}/{topic}" for deputy in self.values.deputies for topic in topics.DEPUTY_TOPICS]
        return all(name in heard for name in (topics.CLOCK, topics.TRUTH, topics.EVENTS, *names))

    def _say(self, text: str) -> None:
        if text != self._said:
            self.get_logger().info(text)
            self._said = text

    def _report(self, message: str) -> None:
        now = self._reported = monotonic()
        elapsed = now - self._started if self._flying else 0.0
        flown = self.plant.tick * self.values.tick
        figures = {
            "tick": self.plant.tick,
            "ticks": self.values.ticks,
            "misses": self._misses,
            "wall_time": round(elapsed, 6),
            "speedup": round(flown / elapsed, 3) if elapsed > 0.0 else 0.0,
        }
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if self._misses else DiagnosticStatus.OK,
            name="formation_gnc: run",
            message=message,
            values=[KeyValue(key=key, value=str(value)) for key, value in figures.items()],
        )
        report = DiagnosticArray(status=[status])
        report.header.stamp.sec, report.header.stamp.nanosec = divmod(self.plant.time, NANOSECONDS)
        self._diagnostics.publish(report)


def fly(node: PlantNode) -> None:
    """Fly the run to its end, and see the recorder through."""
    node.spin(lambda: asked_to_stop() or node.check(), lambda: node.period)
    node.spin(lambda: asked_to_stop() or not node.wait_for_recorder())


def main() -> int:
    """Run the node."""
    return run(PlantNode, fly)
