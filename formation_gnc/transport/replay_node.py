"""The replay node: plays recorded topics with `/clock`, in step with those who answer, or paced."""

from functools import partial
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import SetBool, Trigger

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.reception import Information
from formation_gnc.recording.player import PlayedTick, ReplayParameters, TickPlayer
from formation_gnc.records import Clock, Thrust
from formation_gnc.transport.diagnostics import PERIOD, DiagnosticsPublisher
from formation_gnc.transport.message_types import message_class
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.qos import quality
from formation_gnc.transport.subscriptions import first_stamp
from formation_gnc.types import NANOSECONDS

BURST = 50
"""Ticks played at most before services are looked after again."""

CHECK_PERIOD = 0.002
"""Wall time (s) between checks of pace and patience."""


class ReplayNode(ConfiguredNode):
    """Carries a player's messages to the graph, and the answers to it."""

    def __init__(self) -> None:
        """Open the bag; raises ConfigurationError when it cannot be played."""
        super().__init__("replay", ReplayParameters)
        self.player = TickPlayer(self.values, self._play)
        self._played = {name: self._publisher(name) for name in self.player.topics}
        self._publish_clock = self.publisher_of(Clock, topics.CLOCK.name)
        for name in sorted(self.player.answers):
            self.subscribe(Thrust, name, partial(self._on_answer, name), decode=first_stamp)
        self._diagnostics = DiagnosticsPublisher(self, self.full_name("") or "/")
        self.create_wall_timer(PERIOD, self._diagnose)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)

    def _publisher(self, topic: str) -> Any:
        bag = self.player.bag
        try:
            kind = message_class(bag.topics[topic].type_name)
        except ConfigurationError as error:
            raise ConfigurationError(f"topic {topic}: {error}") from None
        bag.check_type(topic)
        return self.create_publisher(kind, self.full_name(topic), quality())

    def _play(self, tick: PlayedTick) -> None:
        for topic, data in tick.messages:
            self._played[topic].publish(data)
        self._publish_clock(Clock(tick.stamp))

    def _is_published(self, topic: str) -> bool:
        return bool(self.count_publishers(self.full_name(topic)))

    def check(self) -> bool:
        """Play what is due; returns whether the end is reached."""
        for _ in range(BURST):
            before = self.player.stamp
            given_up = self.player.advance_if_due(monotonic(), self._is_published)
            if given_up:
                self.get_logger().warning(f"no answer on {', '.join(given_up)}: going on")
            if self.player.stamp == before:
                break
        return self.player.done

    def _diagnose(self) -> None:
        player = self.player
        message = "paused" if player.paused else "at the end" if player.done else "playing"
        stamp = player.stamp or 0
        values = {"bag": player.bag.path, "played_to": stamp / NANOSECONDS}
        self._diagnostics.publish(DiagnosticStatus.OK, message, values, stamp)

    def _on_answer(self, topic: str, stamp: int, _: Information) -> None:
        self.player.answer(topic, stamp)
        self.check()

    def _on_pause(self, request: Any, response: Any) -> Any:
        self.player.paused = request.data
        response.success, response.message = True, "paused" if request.data else "playing"
        return response

    def _on_step(self, _request: Any, response: Any) -> Any:
        player = self.player
        response.success = player.paused and not player.done
        if response.success:
            player.step(monotonic(), self._is_published)
            response.message = f"played {(player.stamp or 0) / NANOSECONDS:g} s"
        else:
            response.message = "at the end" if player.done else "not paused"
        return response
