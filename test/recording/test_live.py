"""Requests of a viewer while a bag is played."""

import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from foxglove.websocket import PlaybackCommand

from formation_gnc.messages.conversion import to_cdr
from formation_gnc.recording import Bag
from formation_gnc.recording.live_player import LivePlayer
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Clock


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, 100.0])
def test_a_bag_is_played_to_its_end_at_any_requested_speed(tmp_path: Path, speed) -> None:
    with BagWriter(tmp_path / "run", {}) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", depth=10)
        for second in (1, 2, 3):
            writer.write("/clock", to_cdr(Clock(second * 10**9)), second * 10**9, second)
    player = LivePlayer(Bag(tmp_path / "run"), 0, None, 200.0)
    try:
        request = SimpleNamespace(
            playback_command=PlaybackCommand.Play, playback_speed=speed, seek_time=None, request_id="1"
        )
        state = player.on_playback_control_request(request)
        assert state.playback_speed == (speed if speed > 0.0 else 200.0), "the speed in force"
        played: list[int] = []
        player.view.show = lambda topic, data, stamp: played.append(stamp)
        player.play(lambda: len(played) == 3)
        assert played == [10**9, 2 * 10**9, 3 * 10**9]
    finally:
        player.view.close()
