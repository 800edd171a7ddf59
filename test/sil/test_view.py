"""The live view, looked at as a browser does: over the Foxglove WebSocket protocol."""

import base64
import json
import os
import re
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.cli import main
from formation_gnc.recording import Bag
from formation_gnc.recording.decode import MessageType

from .conftest import PARTS, PATIENCE, Desk

pytestmark = pytest.mark.sil


class Viewer:
    """The least of a client: the handshake, whole unfragmented frames, text and binary."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), PATIENCE)
        key = base64.b64encode(os.urandom(16)).decode()
        self._socket.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
        )
        self._stream = self._socket.makefile("rb")
        assert b"101" in self._stream.readline()
        while self._stream.readline().strip():
            pass
        self.channels: dict[str, dict[str, Any]] = {}
        self.answers: list[dict[str, Any]] = []

    def say(self, message: dict[str, Any]) -> None:
        self._send(0x81, json.dumps(message).encode())

    def send_binary(self, data: bytes) -> None:
        self._send(0x82, data)

    def _send(self, opcode: int, data: bytes) -> None:
        size = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
        self._socket.sendall(bytes([opcode]) + size + bytes(4) + data)  # a mask of zeros

    def hear(self) -> Iterator[tuple[int, int, bytes]]:
        """Subscription, stamp in ns and bytes of every message; the rest is noted."""
        while True:
            first, size = self._stream.read(2)
            if size >= 126:
                size = int.from_bytes(self._stream.read(2 if size == 126 else 8))
            data = self._stream.read(size)
            if first == 0x81:
                said = json.loads(data)
                self.answers.append(said)
                for channel in said.get("channels", ()) if said["op"] == "advertise" else ():
                    self.channels[channel["topic"]] = channel
                yield -1, 0, b""
            elif data[0] == 1:
                yield *struct.unpack_from("<IQ", data, 1), data[13:]

    def watch(self, topics: list[str], count: int) -> dict[str, list[tuple[int, Any]]]:
        """Stamps and messages of so many of each topic, taken apart by the schema that comes along."""
        seen: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in topics}
        asked, kinds = False, {}
        for number, stamp, data in self.hear():
            if not asked and all(topic in self.channels for topic in topics):
                asked = True
                for number, topic in enumerate(topics):
                    channel = self.channels[topic]
                    assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
                    kinds[number] = MessageType(channel["schemaName"], channel["schema"].encode(), "ros2msg")
                wanted = [
                    {"id": number, "channelId": self.channels[topic]["id"]} for number, topic in enumerate(topics)
                ]
                self.say({"op": "subscribe", "subscriptions": wanted})
            elif data:
                seen[topics[number]].append((stamp, kinds[number].message(data)))
                if all(len(messages) >= count for messages in seen.values()):
                    break
        return seen


class View:
    """A running `formation-gnc view`."""

    def __init__(self, domain: int, *arguments: str) -> None:
        self.process = subprocess.Popen(
            ["formation-gnc", "view", "--port", "0", *arguments],
            env=os.environ | {"ROS_DOMAIN_ID": str(domain)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        match = re.search(r"serving ws://127\.0\.0\.1:(\d+)", self.process.stdout.readline())
        assert match is not None
        self.port = int(match[1])

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)
        _, errors = self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == 0, errors
        assert "Traceback" not in errors


@pytest.fixture
def view() -> Iterator[Callable[..., View]]:
    started: list[View] = []

    def start(domain: int, *arguments: str) -> View:
        started.append(View(domain, *arguments))
        return started[-1]

    yield start
    for each in started:
        each.process.kill()
        each.process.communicate()


def test_a_viewer_sees_a_running_graph_live(desk: Desk, view: Callable[..., View]) -> None:
    layout = desk.directory / "layout.json"
    server = view(desk.domain, "--layout", str(layout))
    desk.start("plant", real_time_factor=50.0)
    for kind in PARTS:
        desk.start(kind)
    seen = Viewer(server.port).watch(["/clock", "/truth", "/deputy1/thrust"], 20)
    for messages in seen.values():
        assert all(earlier[0] < later[0] for earlier, later in pairwise(messages))
    for stamp, truth in seen["/truth"]:
        assert stamp == truth.header.stamp.sec * 10**9, "simulated time"
        assert truth.deputies[0].name == "deputy1"
        assert 80.0 < abs(truth.deputies[0].relative_state[1]) < 120.0, "about its 100 m behind"
    assert "deputy1-path" in layout.read_text()
    server.stop()


@pytest.mark.covers(
    "Kremmydas Listing: simulation animation",
    differs="any viewer of paths in place of a film of MATLAB's",
)
def test_a_bag_is_played_at_its_pace_and_where_a_viewer_seeks(
    fly: Callable[..., Bag], view: Callable[..., View]
) -> None:
    bag = fly("--duration", "400", "--in-process")
    server = view(0, "--bag", str(bag.path), "--rate", "20")
    viewer = Viewer(server.port)
    started = time.monotonic()
    seen = viewer.watch(["/truth"], 30)["/truth"]
    assert time.monotonic() - started > 1.0, "29 s at 20 times real time"
    recorded = bag.arrays("/truth")
    rows = [stamp // 10**9 for stamp, _ in seen]
    assert rows == list(range(rows[0], rows[0] + 30))
    for row, (_, truth) in zip(rows, seen, strict=True):
        assert truth.chief_state.tolist() == recorded["chief_state"][row].tolist()
    # play, at speed 50, seek to 350 s, request "go"
    viewer.send_binary(struct.pack("<BBfBQI", 3, 0, 50.0, 1, 350 * 10**9, 2) + b"go")
    stamps = [stamp // 10**9 for _, stamp, data in _until(viewer, 399) if data]
    assert stamps[-50:] == list(range(350, 400))
    server.stop()


def _until(viewer: Viewer, second: int) -> Iterator[tuple[int, int, bytes]]:
    for each in viewer.hear():
        yield each
        if each[1] == second * 10**9:
            return


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--port", "-1"], "port -1: "),
        (["--bag", "/nowhere"], "/nowhere: no such bag"),
        (["--layout", "/nowhere/layout.json"], "layout /nowhere/layout.json: No such file"),
    ],
)
def test_what_cannot_be_shown_is_rejected_in_one_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.getsignal(signal.SIGTERM)
    try:
        assert main(["view", "--port", "0", *arguments]) == 2
    finally:
        signal.signal(signal.SIGTERM, before)
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.count("\n") == 1
    assert said in errors
    assert Path("/nowhere").exists() is False
