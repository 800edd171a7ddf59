"""Playback of a bag tick by tick, waiting for the answers of nodes that take part."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from formation_gnc.common import ANY_ORBIT, CommonParameters, Orbit
from formation_gnc.errors import BagError, ParameterError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import COMMAND
from formation_gnc.parameters import parameter
from formation_gnc.recording.reader import Bag
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True)
class ReplayParameters(CommonParameters):
    """Parameters of the replay node."""

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

    def __post_init__(self) -> None:
        """Raise ParameterError for an end that is not after the start."""
        super().__post_init__()
        if not self.start < self.end:
            raise ParameterError(f"parameter end: {self.end} is not allowed; it must be above start, {self.start}")


@dataclass(frozen=True)
class PlayedTick:
    """Recorded messages of one stamp."""

    stamp: int
    """ns."""
    messages: list[tuple[str, bytes]]
    """Topics and CDR bytes to play."""
    answers: set[str]
    """Topics of the commands that answered the tick in the recorded run."""


class TickPlayer:
    """Plays the messages of a stamp, waits for the commands that answer it, and continues with the next.

    A command is awaited where it has a publisher and the recorded tick had it. Times `now` are seconds of a
    monotonic wall clock.

    Attributes:
        topics: topics that are played.
        answers: topics of commands that may be awaited.
        awaited: topics of commands that are awaited now.
        stamp: of the last tick played, ns; None before the first.
        done: whether all ticks are played.
        paused: whether to wait for `step`.
    """

    def __init__(self, parameters: ReplayParameters, play: Callable[[PlayedTick], None]) -> None:
        """Open the bag.

        Args:
            parameters: of the playback.
            play: publishes the messages of a tick, and its stamp as the time.

        Raises:
            ParameterError: no bag is named.
            BagError: the bag cannot be read, or lacks a topic.
        """
        if not parameters.bag:
            raise ParameterError("parameter bag: missing; give a bag to play")
        self._parameters, self._play = parameters, play
        self.bag = Bag(parameters.bag).runs()[0]
        measured = [topics.MEASUREMENT.of(deputy) for deputy in topics.deputies_in(self.bag.topics)]
        default = [*measured, *(name for name in self.bag.topics if name == topics.TRUTH.name)]
        self.topics = [name for name in parameters.topics or default if name != topics.CLOCK.name]
        for name in self.topics:
            if name not in self.bag.topics:
                raise BagError(f"topic {name}: not in the bag; it has {', '.join(sorted(self.bag.topics))}")
        played = {topics.deputy_of(name) for name in self.topics if name in measured}
        self.answers = {COMMAND.of(deputy) for deputy in played} & self.bag.topics.keys() - set(self.topics)
        self.done, self.paused = False, parameters.paused
        self.stamp: int | None = None
        self.awaited: set[str] = set()
        self._ticks = self._read()
        self._played_at = 0.0

    def advance_if_due(self, now: float, is_published: Callable[[str], bool]) -> list[str]:
        """Play the next tick if it is due.

        Args:
            now: s.
            is_published: whether a topic has a publisher.

        Returns:
            Topics whose answer did not come in time.
        """
        waited = now - self._played_at
        if self.paused or self.done or (self.awaited and waited < self._parameters.patience):
            return []
        given_up, self.awaited = sorted(self.awaited), set()
        rate = self._parameters.rate
        if rate == 0.0 or self.stamp is None or waited >= self._parameters.tick / rate:
            self.step(now, is_published)
        return given_up

    def step(self, now: float, is_published: Callable[[str], bool]) -> None:
        """Play the next tick."""
        tick = next(self._ticks, None)
        if tick is None:
            self.done = True
            return
        self.stamp, self._played_at = tick.stamp, now
        self.awaited = {name for name in tick.answers if is_published(name)}
        self._play(tick)

    def answer(self, topic: str, stamp: int) -> None:
        """Take an answer to the tick of a stamp, ns."""
        if stamp == self.stamp:
            self.awaited.discard(topic)

    def _read(self) -> Iterator[PlayedTick]:
        """All ticks; endless when looping."""
        wanted = sorted({*self.topics, *self.answers})
        while True:
            any_played = False
            for tick in self._pass(wanted, set(self.topics)):
                any_played = True
                yield tick
            if not self._parameters.loop or not any_played:
                return

    def _pass(self, wanted: list[str], played: Collection[str]) -> Iterator[PlayedTick]:
        parameters = self._parameters
        first, last = round(parameters.start * NANOSECONDS), round(parameters.end * NANOSECONDS)
        tick = PlayedTick(-1, [], set())
        for stamp, topic, group in self.bag.by_stamp(wanted):
            if not first <= stamp < last:
                continue
            if stamp != tick.stamp:
                if tick.messages:
                    yield tick
                tick = PlayedTick(stamp, [], set())
            if topic in played:
                tick.messages.extend((topic, data) for data in group)
            else:
                tick.answers.add(topic)
        if tick.messages:
            yield tick
