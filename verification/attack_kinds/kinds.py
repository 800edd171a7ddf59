"""Every attack by what it is."""

import shutil
import signal
import struct
import time
from dataclasses import replace
from functools import partial
from math import inf, nan
from typing import Any

import numpy as np
import rclpy
from rclpy.qos import QoSDurabilityPolicy, QoSReliabilityPolicy

from formation_gnc.messages.conversion import from_cdr, to_cdr
from formation_gnc.records import Clock, Estimate, Event, Measurement, Target, Thrust
from formation_gnc.sil.scenario import find_scenario
from formation_gnc.transport.qos import quality
from verification.attack_kinds.raid import Attack, Raid

OWN = [f"/deputy1/{name}" for name in ("measurement", "estimate", "target", "thrust", "mode", "status")]
RUN = ["/events", "/clock", "/truth"]
PROGRESS, CLOCK = "/recorder/progress", "rosgraph_msgs/msg/Clock"
END = (2**31 - 1) * 10**9
LAWS = ("lqr", "mpc", "sdre", "coast")


def cut(raid: Raid, topic: str) -> None:
    """Messages that end too early, somewhere."""
    data = raid.recorded(topic)[:50]
    raid.send(topic, [each[: raid.chance.randrange(len(each))] for each in data])


def on_all(raid: Raid, data: Any) -> None:
    """Bytes on every topic of the flight."""
    for topic in (*OWN, *RUN):
        raid.send(topic, data(raid) if callable(data) else data)


def played(raid: Raid, *topics: str) -> None:
    """Messages of another flight, whose stamps are those of this one."""
    for topic in topics:
        raid.send(topic, raid.recorded(topic))


def flood(raid: Raid, topic: str, number: int = 20_000) -> None:
    """The same message again and again."""
    raid.send(topic, raid.recorded(topic)[:1] * number)


def forged(raid: Raid, topic: str, record: Any, **values: Any) -> None:
    """Messages of the other flight with other values."""
    raid.send(topic, [to_cdr(replace(from_cdr(record, data), **values)) for data in raid.recorded(topic)])


def strings(raid: Raid, topic: str) -> None:
    """Another type on a topic."""
    raid.send(topic, [b"\0\1\0\0\5\0\0\0fire\0\0\0\0"] * 100, "std_msgs/msg/String")


def clock(raid: Raid, topic: str, stamp: int) -> None:
    """A forged time."""
    raid.send(topic, [to_cdr(Clock(stamp))] * 100, CLOCK)
    time.sleep(1.0)


def ahead(raid: Raid) -> None:
    """Measurements of times far ahead."""
    measurement = from_cdr(Measurement, raid.recorded(OWN[0])[0])
    raid.send(OWN[0], [to_cdr(replace(measurement, time=END - each)) for each in range(100)])


def at_best(raid: Raid) -> None:
    """Commands of a publisher that is volatile and does its best."""
    profile = quality()
    profile.durability, profile.reliability = QoSDurabilityPolicy.VOLATILE, QoSReliabilityPolicy.BEST_EFFORT
    raid.send(OWN[3], raid.recorded(OWN[3]), profile=profile)


def bad_values(raid: Raid) -> None:
    """Parameters of the wrong type, out of bounds, unknown, and those that are set at the start alone."""
    for values in ({"algorithm": "none"}, {"algorithm": 7}, {"tick": nan}, {"nothing": 1.0}, {"lqr.thrust": -inf}):
        assert raid.set("/deputy1/controller", **values)
    assert raid.set("/plant", tick=0.5)


def nested(raid: Raid) -> None:
    """A schedule nested deeply."""
    for node in ("/deputy1/controller", "/deputy1/guidance"):
        assert raid.set(node, schedule=["[" * 5000])


def designs(raid: Raid) -> None:
    """A flood of changes that each have to be designed, and are not waited for."""
    from rcl_interfaces.srv import SetParametersAtomically
    from rclpy.parameter import Parameter

    client = raid.node.create_client(SetParametersAtomically, "/deputy1/controller/set_parameters_atomically")
    client.wait_for_service(timeout_sec=5.0)
    for number in range(200):
        parameter = Parameter("algorithm", value=LAWS[number % len(LAWS)]).to_parameter_msg()
        client.call_async(SetParametersAtomically.Request(parameters=[parameter]))
    time.sleep(1.0)


def stopped(raid: Raid, node: str, seconds: float) -> None:
    """A node stopped, and continued."""
    raid.signal(node, signal.SIGSTOP)
    time.sleep(seconds)
    raid.signal(node, signal.SIGCONT)


def second(raid: Raid, kind: str, *arguments: str) -> None:
    """A second node of a kind, by the same name."""
    with raid.started(kind, *arguments, "--params-file", str(find_scenario("leader_follower"))):
        time.sleep(5.0)


def crowd(raid: Raid) -> None:
    """Forty nodes that come and go."""
    for number in range(40):
        rclpy.create_node(f"visitor{number}", context=raid.node.context).destroy_node()


def listeners(raid: Raid) -> None:
    """Two hundred readers of one topic, which nobody serves."""
    from formation_gnc.transport.message_types import message_type

    for _ in range(200):
        raid.node.create_subscription(message_type(Thrust), OWN[3], lambda _: None, quality())
    time.sleep(1.0)


def impostor(raid: Raid) -> None:
    """A report of the run in its name: it is over."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    status = DiagnosticStatus(name="formation_gnc: run", message="finished")
    publisher = raid.node.create_publisher(DiagnosticArray, "/diagnostics", quality())
    time.sleep(0.5)
    for _ in range(50):
        publisher.publish(DiagnosticArray(status=[status]))


ZERO, ORBIT = np.zeros(6), np.array([7e6, 0.0, 0.0, 0.0, 0.0, 0.0])
SHORT, FULL = [b"\0\1\0\0", b"", b"\0"], [b"\0\1\0\0" + b"\xff" * 200]

ATTACKS: dict[str, Attack] = {
    "nothing: the flight alone": lambda raid: None,
    **{f"messages cut short on {topic}": partial(cut, topic=topic) for topic in (*OWN, *RUN)},
    "no more than an encapsulation, on every topic": partial(on_all, data=SHORT),
    "counts beyond the end, on every topic": partial(on_all, data=FULL),
    "random bytes on every topic": partial(
        on_all, data=lambda raid: [raid.chance.randbytes(raid.chance.randrange(600)) for _ in range(100)]
    ),
    "estimates in the other byte order": lambda raid: raid.send(
        OWN[1], [b"\0\0" + data[2:] for data in raid.recorded(OWN[1])]
    ),
    **{f"another type on {topic}": partial(strings, topic=topic) for topic in (OWN[0], OWN[3], "/clock")},
    "a clock that goes back": partial(clock, topic="/clock", stamp=0),
    "a clock of 2038": partial(clock, topic="/clock", stamp=END),
    "progress of the recorder up to 2038": partial(clock, topic=PROGRESS, stamp=END),
    "progress of the recorder that stands still": partial(clock, topic=PROGRESS, stamp=0),
    **{f"another flight's {topic}": (lambda raid, topic=topic: played(raid, topic)) for topic in OWN},
    "another flight's clock and truth": lambda raid: played(raid, "/clock", "/truth"),
    "another flight's topics, all": lambda raid: played(raid, *OWN, *RUN),
    **{f"a flood on {topic}": partial(flood, topic=topic) for topic in (*OWN[:5], "/events")},
    "an event without words": lambda raid: raid.send("/events", [to_cdr(Event(0, 0, "", 255))] * 20),
    "events of 900 kB": lambda raid: raid.send(
        "/events", [to_cdr(Event(0, 0, "/plant", 13, "x", [], "x" * 900_000))] * 20
    ),
    "a chief at the centre of the Earth": partial(forged, topic=OWN[0], record=Measurement, chief_state=ZERO),
    "a chief without speed": partial(forged, topic=OWN[0], record=Measurement, chief_state=ORBIT),
    "measurements of 2038": ahead,
    "targets with a preview step of -1e15": lambda raid: raid.send(
        OWN[2],
        [data.replace(struct.pack("<iI", 1, 0), struct.pack("<iI", -1_000_000, 0)) for data in raid.recorded(OWN[2])],
    ),
    "targets with an endless preview": partial(forged, topic=OWN[2], record=Target, preview=np.zeros((30_000, 6))),
    "targets that are not numbers": partial(forged, topic=OWN[2], record=Target, relative_state=np.full(6, nan)),
    "estimates that are not numbers": partial(forged, topic=OWN[1], record=Estimate, relative_state=np.full(6, nan)),
    "a thrust of 1e30 N": partial(forged, topic=OWN[3], record=Thrust, force=np.full(3, 1e30)),
    "an infinite thrust": partial(forged, topic=OWN[3], record=Thrust, force=np.full(3, inf)),
    "thrust, volatile and at best": at_best,
    "a report that the run is over": impostor,
    "parameters that are not allowed": bad_values,
    "schedules nested five thousand deep": nested,
    "two hundred changes of the law at once": designs,
    "the recorder killed": lambda raid: raid.signal("/recorder", signal.SIGKILL),
    "the recorder stopped for 3 s": partial(stopped, node="/recorder", seconds=3.0),
    "the bag deleted": lambda raid: shutil.rmtree(raid.bag),
    **{
        f"the {kind} killed": lambda raid, kind=kind: raid.signal(f"/deputy1/{kind}", signal.SIGKILL)
        for kind in ("navigation", "guidance", "controller", "supervisor")
    },
    "the navigation stopped for 2 s": partial(stopped, node="/deputy1/navigation", seconds=2.0),
    "the plant stopped for 2 s": partial(stopped, node="/plant", seconds=2.0),
    "a second controller": lambda raid: second(raid, "controller", "-r", "__ns:=/deputy1"),
    "a second navigation": lambda raid: second(raid, "navigation", "-r", "__ns:=/deputy1"),
    "a second plant": lambda raid: second(raid, "plant"),
    "a second recorder into the same bag": lambda raid: second(raid, "recorder", "-p", f"bag:={raid.bag}"),
    "the other flight replayed by our own node": lambda raid: second(raid, "replay", "-p", f"bag:={raid.other.path}"),
    "forty nodes that come and go": crowd,
    "two hundred readers that read nothing": listeners,
}
