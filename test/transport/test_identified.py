"""Subscriptions that come and go in a flood of messages, and the loop that serves them."""

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
from formation_gnc.transport.identified import IdentifiedSubscription, inbox_of
from formation_gnc.transport.loop import Loop
from formation_gnc.transport.qos import quality

rclpy.init()
talker, listener = rclpy.create_node("talker"), rclpy.create_node("listener")
publisher = talker.create_publisher(String, "/x", quality(500))

def flood():
    while True:
        publisher.publish(String(data="x"))
        time.sleep(0.0005)

threading.Thread(target=flood, daemon=True).start()
loop = Loop(listener)
received, current, looks = [], [], []

def look():
    if current:
        current.pop().destroy()
    events = SubscriptionEventCallbacks()
    current.append(IdentifiedSubscription(listener, String, "/x", lambda *m: received.append(m), quality(500), events))
    looks.append(len(received))

listener.create_timer(0.02, look)
while len(looks) < 100:
    loop.spin(0.1)
loop.remove(listener)
inbox_of(listener).clear()
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
