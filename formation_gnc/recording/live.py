"""Server that shows topics live in Foxglove, over its WebSocket protocol."""

import logging
from pathlib import Path

import foxglove
from foxglove.websocket import Capability, PlaybackState, ServerListener

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.recording.layout import foxglove_layout
from formation_gnc.recording.topic_definition import TopicDefinition


class LiveView:
    """Serves topics to the viewers that connect, on this machine alone."""

    def __init__(
        self,
        name: str,
        port: int,
        layout: Path | None = None,
        span_ns: tuple[int, int] | None = None,
        listener: ServerListener | None = None,
    ) -> None:
        """Start the server.

        Args:
            name: of the data source, for viewers.
            port: to listen on; 0 for any that is free.
            layout: file to write the layout of the deputies to.
            span_ns: first and last stamp of a bag; viewers may then pause, seek and change the speed.
            listener: receives the requests of viewers.

        Raises:
            ConfigurationError: the port is not free, or the layout cannot be written.
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
        """WebSocket address of the server."""
        return f"ws://127.0.0.1:{self._server.port}"

    @property
    def page(self) -> str:
        """Address of a page that opens the server in a browser."""
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
        """Send a message to the viewers of its topic."""
        self._channels[topic].log(data, log_time=stamp_ns)

    def broadcast_time(self, stamp_ns: int) -> None:
        """Send the simulated time to all viewers."""
        self._server.broadcast_time(stamp_ns)

    def broadcast_playback(self, state: PlaybackState) -> None:
        """Send the state of a playback to all viewers."""
        self._server.broadcast_playback_state(state)

    def close(self) -> None:
        """Stop the server."""
        self._server.stop()
