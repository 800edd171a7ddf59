"""Subscriptions that come and go under an executor, which crashes where one is destroyed with messages in its queue."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("rclpy")

RESUBSCRIBE = """
import os, threading, time
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from std_msgs.msg import String
from formation_gnc.transport.identified import IdentifiedSubscription, unsubscribe
from formation_gnc.transport.node import Executor
from formation_gnc.transport.qos import quality

rclpy.init()
talker, listener = rclpy.create_node("talker"), rclpy.create_node("listener")
publisher = talker.create_publisher(String, "/x", quality(500))

def flood():
    while True:
        publisher.publish(String(data="x"))
        time.sleep(0.0005)

threading.Thread(target=flood, daemon=True).start()
executor = Executor()
executor.add_node(listener)
received, current, replaced = [], [], []

def look():
    while replaced:
        replaced.pop().destroy()
    if current:
        current[-1].silence()
        replaced.append(current.pop())
    events = SubscriptionEventCallbacks()
    current.append(IdentifiedSubscription(listener, String, "/x", lambda *m: received.append(m), quality(500), events))
    looks.append(len(received))

looks = []
listener.create_timer(0.02, look)
while len(looks) < 100:
    executor.spin_once(timeout_sec=0.1)
unsubscribe(listener, executor)
executor.remove_node(listener)
assert len(received) > 100, len(received)
print("stood", flush=True)
os._exit(0)
"""


@pytest.mark.sil
def test_subscribing_anew_in_a_flood_of_messages_does_not_end_the_process() -> None:
    environment = os.environ | {"PYTHONFAULTHANDLER": "1"}
    command = [sys.executable, "-c", RESUBSCRIBE]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert result.stdout == "stood\n", result.stderr[-2000:]
