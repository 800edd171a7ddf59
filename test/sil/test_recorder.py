"""The recorder as a real process: what it says of a run, and what is left when it, or the disk, ends."""

import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from formation_gnc.flight import topics
from formation_gnc.recording import Bag
from formation_gnc.recording.layout import LAYOUT
from formation_gnc.recording.provenance import LOST
from formation_gnc.recording.recover import PARTLY_LOST, recover
from formation_gnc.recording.writer import FLUSH_INTERVAL
from formation_gnc.sil.simulation import RECORDER_LAG
from formation_gnc.transport.qos import LATEST, quality
from formation_gnc.types import NANOSECONDS

from .conftest import GNC_TOPICS, PARTS, PATIENCE, Desk, Terminal, wait_until

pytestmark = pytest.mark.sil


@contextmanager
def user(desk: Desk) -> Iterator[tuple[Any, SingleThreadedExecutor]]:
    """Somebody else's node in the graph, and what lets it work."""
    context = Context()
    rclpy.init(context=context, domain_id=desk.domain)
    node = rclpy.create_node("user", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield node, executor
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def stop(*terminals: Terminal) -> None:
    for terminal in terminals:
        terminal.signal(signal.SIGINT)
    for terminal in terminals:
        assert terminal.wait() == 0, terminal.text


def test_a_bag_says_all_of_its_run_and_nothing_of_the_machine(fly: Callable[..., Bag]) -> None:
    bag = fly("--duration", "200", "--seed", "7")
    assert bag.metadata["run"] == {"scenario": "leader_follower", "seed": "7"}
    assert {"formation_gnc", "commit", "python", "numpy", "mcap"} <= bag.metadata["versions"].keys()
    nodes = ("/plant", "/recorder", *(f"/deputy1/{part}" for part in PARTS))
    assert {f"parameters {node}" for node in nodes} <= bag.metadata.keys()
    assert bag.metadata[LOST].keys() == bag.topics.keys()
    assert set(bag.metadata[LOST].values()) == {"0"}
    assert set(bag.attachments) == {"leader_follower.yaml", LAYOUT}
    said = f"{bag.metadata} {bag.attachments}"
    assert str(bag.path.parent) not in said
    assert str(Path.home()) not in said
    for topic in GNC_TOPICS:
        with Reader(bag.path) as reader, (bag.path / "bag_0.mcap").open("rb") as stream:
            assert reader.topics[topic].msgcount == 200
            numbers = [m.sequence for _, _, m in make_reader(stream).iter_messages([topic])]
            assert numbers == list(range(1, 201)), "the log itself shows that nothing is missing"


def test_a_recorder_that_comes_late_knows_exactly_what_it_missed(desk: Desk) -> None:
    ticks = 16 * topics.QUEUE_DEPTH  # at this pace it has 15 s to come in
    plant = desk.start("plant", duration=float(ticks), real_time_factor=500.0)
    parts = [desk.start(kind) for kind in PARTS]
    with user(desk) as (node, executor):
        heard: list[int] = []
        node.create_subscription(Clock, topics.CLOCK.name, lambda clock: heard.append(clock.clock.sec), quality(LATEST))

        def late() -> bool:
            executor.spin_once(timeout_sec=0.0)
            return bool(heard) and heard[-1] > 1.2 * topics.QUEUE_DEPTH

        wait_until(late, "more ticks than writers keep")
    recorder = desk.start("recorder", bag=desk.directory / "bag", split_duration=200.0)
    assert plant.wait() == 0
    stop(recorder, *parts)
    bag = Bag(desk.directory / "bag")
    assert len(list(bag.path.glob("*.mcap"))) > 3, "a file every 200 s"
    lost = {topic: int(count) for topic, count in bag.metadata[LOST].items()}
    for topic in GNC_TOPICS:
        assert lost[topic] > 0
        assert lost[topic] + bag.topics[topic].count == ticks, topic
    assert bag.lost == sum(lost.values())
    assert "lost so far: " in recorder.text


def run_in_process_of_its_own(script: str, desk: Desk, bag: Path) -> None:
    """Run a script that makes a recorder, since its node would stay in the domain of later tests."""
    arguments = ["--ros-args", "--params-file", str(desk.parameters), "-p", f"bag:={bag}"]
    told = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        env=desk.environment,
        timeout=2 * PATIENCE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stderr


IDLER = """
import signal
import sys
import time

import rclpy
from formation_gnc_msgs.msg import Event

from formation_gnc.flight import topics
from formation_gnc.transport import process
from formation_gnc.transport.qos import quality
from formation_gnc.nodes.recorder import QUIET, RecorderNode, record
from formation_gnc.records import EventKind

rclpy.init(args=sys.argv)
recorder, user = RecorderNode(), rclpy.create_node("user")
publisher = user.create_publisher(Event, topics.EVENTS.name, quality())
recorder.spin(lambda: publisher.get_subscription_count() > 0)
for tick in range(50):
    publisher.publish(Event(tick=tick))
time.sleep(2.0 * QUIET)
process._stop_signals.append(signal.SIGINT)
record(recorder)
"""


def test_a_starved_recorder_drains_its_queues_before_it_stops(desk: Desk) -> None:
    bag = desk.directory / "bag"
    run_in_process_of_its_own(IDLER, desk, bag)
    assert Bag(bag).topics[topics.EVENTS.name].count == 50


def test_a_snapshot_has_the_last_stretch_before_the_call(desk: Desk) -> None:
    recorder = desk.start("recorder", bag=desk.directory / "bag", snapshot=50.0)
    plant = desk.start("plant", duration=300.0, wait_for_recorder=True)
    parts = [desk.start(kind) for kind in PARTS]
    assert plant.wait() == 0
    with user(desk) as (node, executor):
        client = node.create_client(Trigger, "/recorder/snapshot")
        assert client.wait_for_service(timeout_sec=PATIENCE)
        answer = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(answer, timeout_sec=PATIENCE)
        assert answer.result().success, answer.result().message
    stop(recorder, *parts)
    bag = Bag(desk.directory / "bag")
    assert bag.damage is None
    for topic in GNC_TOPICS:
        stamps = bag.arrays(topic)["stamp_ns"] // NANOSECONDS
        # the end event bears the time after the last tick, from which the stretch counts
        assert list(stamps) == list(range(251, 300)), topic


def test_a_full_disk_ends_the_run_with_a_reason_and_saves_what_was_written(desk: Desk) -> None:
    recorder = desk.start("recorder", bag=desk.directory / "bag", split_duration=1000.0)
    for kind in PARTS:
        desk.start(kind)
    wait_until(lambda: (desk.directory / "bag/bag_0.mcap").exists(), "the recorder to record")
    limit = 400_000  # a write beyond this fails in its middle, as on a full disk
    desk.start("plant", wait_for_recorder=True, real_time_factor=1000.0)
    time.sleep(2.0)  # what shared memory the middleware needs, it has
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (limit, limit))
    assert recorder.wait() == 1
    last = recorder.text.strip().splitlines()[-1]
    assert last.startswith("recorder: ")
    assert "bag cut short: File too large; `recover` saves what was written" in last
    assert "Traceback" not in recorder.text
    bag = Bag(desk.directory / "bag")
    assert bag.damage is not None
    assert bag.topics["/truth"].count > 100
    assert recover(desk.directory / "bag", desk.directory / "saved").status == PARTLY_LOST


PACE = 200.0  # simulated s per wall s, and ticks
MOST_LOST = RECORDER_LAG + round(4.0 * FLUSH_INTERVAL * PACE)
"""Ticks: what the plant may be ahead of the recorder, and what comes until a flush, which a busy machine is late with.

On a quiet one it is less than half a second of wall time, which the property of each test tells.
"""
MOMENTS = [pytest.param(number, marks=[pytest.mark.slow] * (number > 1), id=str(number)) for number in range(20)]


@pytest.mark.parametrize("everything", [False, True], ids=["recorder", "everything"])
@pytest.mark.parametrize("number", MOMENTS)
def test_a_kill_at_any_moment_loses_a_queue_and_a_flush_at_most(
    desk: Desk, number: int, everything: bool, record_property: Callable[[str, object], None]
) -> None:
    bag = desk.directory / "bag"
    recorder = desk.start("recorder", bag=bag)
    desk.start("plant", duration=17403.0, wait_for_recorder=True, real_time_factor=PACE)
    for kind in PARTS:
        desk.start(kind)
    flown = 0
    with user(desk) as (node, executor):

        def hear(clock: Clock) -> None:
            nonlocal flown
            flown = clock.clock.sec

        node.create_subscription(Clock, topics.CLOCK.name, hear, quality(LATEST))

        def flies() -> bool:
            executor.spin_once(timeout_sec=0.0)
            return flown > 0

        wait_until(flies, "the first tick")
        end = time.monotonic() + random.Random(f"{number} {everything}").uniform(0.0, 3.0)
        while time.monotonic() < end:
            executor.spin_once(timeout_sec=0.001)
        at_kill = flown
    victims = desk.terminals if everything else [recorder]
    for terminal in victims:
        terminal.signal(signal.SIGKILL)
    for terminal in victims:
        terminal.wait()

    result = recover(bag, desk.directory / "saved")
    if at_kill <= MOST_LOST and result.output is None:
        return  # killed before there was anything that had to be saved
    assert result.output is not None
    assert not result.lost
    clocks, decoded = [], []
    with Reader(result.output) as reader:
        for connection, stamp, _ in reader.messages():
            if connection.topic == topics.CLOCK.name:
                clocks.append(stamp // NANOSECONDS)
    with (result.output / "saved_0.mcap").open("rb") as stream:
        by_another = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in by_another.iter_decoded_messages(log_time_order=False):
            if channel.topic == topics.CLOCK.name:
                decoded.append(message.clock.sec)
    assert clocks == decoded == list(range(len(clocks))), "no tick is missing before the last"
    lacks = at_kill - max(clocks, default=0)
    record_property("log lost, s of wall time", lacks / PACE)
    assert lacks <= MOST_LOST
