"""The replay node: plays recorded topics with `/clock`, in step with those who answer, or paced."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from time import monotonic
from typing import Any

from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from formation_gnc.common import ANY_ORBIT, CommonParameters, Orbit
from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import parameter
from formation_gnc.recording.reader import Bag
from formation_gnc.records import Thrust
from formation_gnc.transport import topics
from formation_gnc.transport.conversion import message_class
from formation_gnc.transport.node import ConfiguredNode, asked_to_stop, run
from formation_gnc.transport.raw_topics import first_stamp
from formation_gnc.types import NANOSECONDS

BURST = 50
"""Ticks played at most before services are looked after again."""

CHECK_PERIOD = 0.002
"""Wall time (s) between looks at pace and patience."""


@dataclass(frozen=True)
class ReplayParameters(CommonParameters):
    """What to play, and how fast."""

    chief: Orbit = ANY_ORBIT
    bag: str = parameter("", doc="bag to play")
    topics: tuple[str, ...] = parameter((), doc="topics to play; empty for the truth and all measurements")
    start: float = parameter(0.0, unit="s", minimum=0.0, doc="simulated time to play from")
    end: float = parameter(2.0**31, unit="s", above=0.0, doc="simulated time to play to, itself left out")
    rate: float = parameter(0.0, minimum=0.0, doc="simulated seconds per wall second at most; 0: no limit")
    loop: bool = parameter(False, doc="begin again at the end")
    paused: bool = parameter(False, doc="wait for the pause service to go, or for the step service")
    patience: float = parameter(
        5.0,
        unit="s",
        above=0.0,
        doc="wall time to wait for an answer that was recorded and that a node can give",
    )


class ReplayNode(ConfiguredNode):
    """Publishes all that was recorded of a stamp, waits for the thrust of those who answer, and goes on.

    Who answers is whoever publishes the thrust of a deputy whose measurement is played; nobody is waited for
    on a tick that had no answer when it was recorded.
    """

    def __init__(self) -> None:
        """Open the bag; raises ConfigurationError when it cannot be played."""
        super().__init__("replay", ReplayParameters)
        if not self.values.bag:
            raise ConfigurationError("parameter bag: missing; give a bag to play")
        if not self.values.start < self.values.end:
            raise ConfigurationError(
                f"parameter end: {self.values.end} is not allowed; it must be above start, {self.values.start}"
            )
        self.bag = Bag(self.values.bag)
        measured = [topic for topic in self.bag.topics if topic.endswith(f"/{topics.MEASUREMENT}")]
        default = [*measured, *(topic for topic in self.bag.topics if topic == topics.TRUTH)]
        names = [name for name in self.values.topics or default if name != topics.CLOCK]
        self._played = {name: self.create_publisher(self._type(name), name, topics.quality()) for name in names}
        self._tell_time = self.create_publisher(Clock, topics.CLOCK, topics.quality())
        self._answers = {
            name.replace(topics.MEASUREMENT, topics.THRUST) for name in names if name in measured
        } & self.bag.topics.keys() - self._played.keys()
        for name in sorted(self._answers):
            self.listen(Thrust, name, partial(self._on_thrust, name))
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.done = False
        self._paused = self.values.paused
        self._ticks = self._read()
        self._awaited: set[str] = set()
        self._time: int | None = None
        self._played_at = monotonic()

    def _type(self, topic: str) -> Any:
        if topic not in self.bag.topics:
            raise ConfigurationError(f"topic {topic}: not in the bag; it has {', '.join(sorted(self.bag.topics))}")
        try:
            kind = message_class(self.bag.topics[topic].type_name)
        except ConfigurationError as error:
            raise ConfigurationError(f"topic {topic}: {error}") from None
        self.bag.check_type(topic)
        return kind

    def _read(self) -> Iterator[tuple[int, list[tuple[str, bytes]], set[str]]]:
        """Stamp, messages to play and recorded answers of every tick, for ever when looping."""
        wanted = sorted(self._played.keys() | self._answers)
        first, last = round(self.values.start * NANOSECONDS), round(self.values.end * NANOSECONDS)
        while True:
            time, messages, answers = -1, list[tuple[str, bytes]](), set[str]()
            any_played = False
            for at, topic, group in self.bag.by_stamp(wanted):
                if not first <= at < last:
                    continue
                if at != time and messages:
                    yield time, messages, answers
                if at != time:
                    time, messages, answers = at, [], set()
                if topic in self._played:
                    messages += [(topic, data) for data in group]
                    any_played = True
                else:
                    answers.add(topic)
            if messages:
                yield time, messages, answers
            if not self.values.loop or not any_played:
                return

    def check(self) -> bool:
        """Play what is due, and say whether that was all."""
        for _ in range(BURST):
            if self._paused or self.done or not self._is_due():
                break
            self._play()
        return self.done

    def _is_due(self) -> bool:
        waited = monotonic() - self._played_at
        if self._awaited and waited < self.values.patience:
            return False
        if self._awaited:
            self.get_logger().warning(f"no answer on {', '.join(sorted(self._awaited))}: going on")
            self._awaited = set()
        return self.values.rate == 0.0 or self._time is None or waited >= self.values.tick / self.values.rate

    def _play(self) -> None:
        try:
            self._time, messages, answers = next(self._ticks)
        except StopIteration:
            self.done = True
            return
        self._awaited = {name for name in answers if self.count_publishers(name) > 0}
        self._played_at = monotonic()
        for topic, data in messages:
            self._played[topic].publish(data)
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = divmod(self._time, NANOSECONDS)
        self._tell_time.publish(clock)

    def _on_thrust(self, topic: str, data: bytes) -> None:
        if first_stamp(data) == self._time:
            self._awaited.discard(topic)
            self.check()

    def _on_pause(self, request: Any, response: Any) -> Any:
        self._paused = request.data
        response.success, response.message = True, "paused" if self._paused else "playing"
        return response

    def _on_step(self, _request: Any, response: Any) -> Any:
        response.success = self._paused and not self.done
        if response.success:
            self._play()
            response.message = f"played {(self._time or 0) / NANOSECONDS:g} s"
        else:
            response.message = "at the end" if self.done else "not paused"
        return response


def play(node: ReplayNode) -> None:
    """Play to the end, or until told to stop."""
    node.spin(lambda: asked_to_stop() or node.check(), lambda: CHECK_PERIOD)


def main() -> int:
    """Run the node."""
    return run(ReplayNode, play)
