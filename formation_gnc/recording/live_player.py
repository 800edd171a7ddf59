"""Playback of a bag in Foxglove."""

import time
from collections.abc import Callable
from pathlib import Path

from foxglove.websocket import PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus, ServerListener

from formation_gnc.errors import BagError, ParameterError
from formation_gnc.recording.live import LiveView
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.topic_definition import TopicDefinition

POLL_PERIOD = 0.02
"""Wall time (s) between checks for requests of viewers."""


class LivePlayer(ServerListener):
    """Plays a bag to a view at a given speed; viewers may pause, resume, seek and change the speed."""

    def __init__(self, bag: Bag, port: int, layout: Path | None, speed: float) -> None:
        """Serve a bag.

        Args:
            bag: to play.
            port: to listen on; 0 for any that is free.
            layout: file to write the layout of the deputies to.
            speed: simulated time over wall time.

        Raises:
            BagError: the bag has no messages.
            ParameterError: the speed is not positive.
            ConfigurationError: as for `LiveView`.
        """
        if not any(topic.count for topic in bag.topics.values()):
            raise BagError(f"{bag.path}: holds no message")
        if not speed > 0.0:
            raise ParameterError(f"rate {speed} is not allowed; it must be above 0")
        self._bag, self._speed = bag, speed
        self._playing, self._ended = True, False
        self._time = bag.start_ns
        self._seek_target: int | None = None
        self._anchor = (0.0, 0)  # wall time, s, and the stamp then, ns
        self.view = LiveView(bag.path.absolute().name, port, layout, (bag.start_ns, bag.end_ns), self)
        for topic in bag.topics:
            schema, channel = bag.definition(topic)
            if schema is not None:
                definition = TopicDefinition(schema.name, schema.data, schema.encoding, channel.message_encoding)
                self.view.add(topic, definition)

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState:
        """Apply a viewer's request; called from a thread of the server."""
        self._playing = playback_control_request.playback_command == PlaybackCommand.Play
        if playback_control_request.playback_speed > 0.0:  # any other would stop the playback for good
            self._speed = playback_control_request.playback_speed
        target = playback_control_request.seek_time
        if target is not None:
            self._time = self._seek_target = target
        self._set_anchor()
        return self._state(playback_control_request.request_id, did_seek=target is not None)

    def play(self, ended: Callable[[], bool]) -> None:
        """Play until `ended`; at the end of the bag wait for a viewer to seek."""
        topics = [topic for topic in self._bag.topics if self._bag.definition(topic)[0] is not None]
        self._seek_target = self._bag.start_ns
        while not ended():
            if self._seek_target is None:
                time.sleep(POLL_PERIOD)
                continue
            start, self._seek_target, self._ended = self._seek_target, None, False
            self._time = start
            self._set_anchor()
            for topic, data, stamp in self._bag.messages(topics, start):
                if stamp > self._time and not self._wait_for(stamp, ended):
                    break
                self.view.show(topic, data, stamp)
            else:
                self._ended = True
                self.view.broadcast_playback(self._state(None, did_seek=False))

    def _wait_for(self, stamp: int, ended: Callable[[], bool]) -> bool:
        """Wait until a stamp is due; False when a viewer seeks or the playback ends before."""
        while self._seek_target is None and not ended():
            wall, simulated = self._anchor
            remaining = (stamp - simulated) * 1e-9 / self._speed - (time.monotonic() - wall)
            if self._playing and remaining <= 0.0:
                self._time = stamp
                self.view.broadcast_time(stamp)
                return True
            time.sleep(min(POLL_PERIOD, remaining) if self._playing else POLL_PERIOD)
        return False

    def _set_anchor(self) -> None:
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
