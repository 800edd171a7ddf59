"""Topics live in Foxglove: a server of its WebSocket protocol, and a bag played to it."""

import logging
import time
from collections.abc import Callable
from pathlib import Path

import foxglove
from foxglove.websocket import (
    Capability,
    PlaybackCommand,
    PlaybackControlRequest,
    PlaybackState,
    PlaybackStatus,
    ServerListener,
)

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.recording.layout import foxglove_layout
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import TopicDefinition

NAP = 0.02
"""Wall time (s) between looks at what the viewer asks for."""


class LiveView:
    """A server that shows topics to whoever connects, on this machine alone."""

    def __init__(
        self,
        name: str,
        port: int,
        layout: Path | None = None,
        span_ns: tuple[int, int] | None = None,
        listener: ServerListener | None = None,
    ) -> None:
        """Serve at a port, 0 for any that is free.

        Args:
            name: what viewers are told that they look at.
            port: where to listen.
            layout: file to write the layout to that shows the deputies there are.
            span_ns: first and last stamp of a bag; with it, viewers may pause, seek and change the speed.
            listener: who is told what viewers ask for.

        Raises ConfigurationError when the port cannot be had or the layout not be written.
        """
        logging.getLogger("foxglove").setLevel(logging.WARNING)
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._layout = layout
        self._write_layout()
        try:
            self._server = foxglove.start_server(
                name=name,
                port=port,
                context=self._context,
                capabilities=[Capability.Time],
                server_listener=listener,
                playback_time_range=span_ns,
            )
        except (RuntimeError, OverflowError) as error:
            raise ConfigurationError(f"port {port}: {error}") from None

    @property
    def address(self) -> str:
        """Where a viewer connects to."""
        return f"ws://127.0.0.1:{self._server.port}"

    @property
    def page(self) -> str:
        """What opens it in a browser."""
        return self._server.app_url() or ""

    def add(self, topic: str, definition: TopicDefinition) -> None:
        """Offer a topic."""
        schema = foxglove.Schema(name=definition.type_name, encoding=definition.schema_encoding, data=definition.schema)
        self._channels[topic] = foxglove.Channel(
            topic, schema=schema, message_encoding=definition.message_encoding, context=self._context
        )
        if topics.deputies_in([topic]):
            self._write_layout()

    def _write_layout(self) -> None:
        if self._layout is not None:
            deputies = topics.deputies_in(self._channels)
            try:
                self._layout.write_text(foxglove_layout(deputies))
            except OSError as error:
                raise ConfigurationError(f"layout {self._layout}: {error.strerror}") from None

    def show(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Send a message to those who look at its topic."""
        self._channels[topic].log(data, log_time=stamp_ns)

    def tell_time(self, stamp_ns: int) -> None:
        """Say what time it is in the run."""
        self._server.broadcast_time(stamp_ns)

    def tell_playback(self, state: PlaybackState) -> None:
        """Say where a bag is being played."""
        self._server.broadcast_playback_state(state)

    def close(self) -> None:
        """Serve no more."""
        self._server.stop()


class Player(ServerListener):
    """Plays a bag to a view at a pace, and does what its viewers ask: pause, go on, seek, speed."""

    def __init__(self, bag: Bag, port: int, layout: Path | None, speed: float) -> None:
        """Serve a bag; raises ConfigurationError when it has no messages or the port cannot be had."""
        if not any(topic.count for topic in bag.topics.values()):
            raise ConfigurationError(f"{bag.path}: holds no message")
        if not speed > 0.0:
            raise ConfigurationError(f"rate {speed}: is not allowed; it must be above 0")
        self._bag, self._speed = bag, speed
        self._playing, self._ended = True, False
        self._time = bag.start_ns
        self._sought: int | None = None
        self._anchor = (0.0, 0)
        self.view = LiveView(bag.path.absolute().name, port, layout, (bag.start_ns, bag.end_ns), self)
        for topic in bag.topics:
            schema, channel = bag.definition(topic)
            if schema is not None:
                definition = TopicDefinition(schema.name, schema.data, schema.encoding, channel.message_encoding)
                self.view.add(topic, definition)

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState:
        """Note what a viewer asks for; comes from a thread of the server."""
        self._playing = playback_control_request.playback_command == PlaybackCommand.Play
        if playback_control_request.playback_speed > 0.0:  # with any other nothing would ever come
            self._speed = playback_control_request.playback_speed
        sought = playback_control_request.seek_time
        if sought is not None:
            self._time = self._sought = sought
        self._set_pace()
        return self._state(playback_control_request.request_id, did_seek=sought is not None)

    def play(self, ended: Callable[[], bool]) -> None:
        """Play, and wait at the end for a viewer to seek, until `ended` says so."""
        defined = [topic for topic in self._bag.topics if self._bag.definition(topic)[0] is not None]
        self._sought = self._bag.start_ns
        while not ended():
            if self._sought is None:
                time.sleep(NAP)
                continue
            start, self._sought, self._ended = self._sought, None, False
            self._time = start
            self._set_pace()
            for topic, data, stamp in self._bag.messages(defined, start):
                if stamp > self._time and not self._wait_for(stamp, ended):
                    break
                self.view.show(topic, data, stamp)
            else:
                self._ended = True
                self.view.tell_playback(self._state(None, did_seek=False))

    def _wait_for(self, stamp: int, ended: Callable[[], bool]) -> bool:
        """Whether the time has come for a stamp; not if a viewer seeks or it all ends before."""
        while self._sought is None and not ended():
            wall, simulated = self._anchor
            lack = (stamp - simulated) * 1e-9 / self._speed - (time.monotonic() - wall)
            if self._playing and lack <= 0.0:
                self._time = stamp
                self.view.tell_time(stamp)
                return True
            time.sleep(min(NAP, lack) if self._playing else NAP)
        return False

    def _set_pace(self) -> None:
        self._anchor = (time.monotonic(), self._time)

    def _state(self, request: str | None, did_seek: bool) -> PlaybackState:
        playing = PlaybackStatus.Playing if self._playing else PlaybackStatus.Paused
        return PlaybackState(
            status=PlaybackStatus.Ended if self._ended else playing,
            current_time=self._time,
            playback_speed=self._speed,
            did_seek=did_seek,
            request_id=request,
        )
