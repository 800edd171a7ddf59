"""What the node graph recorded, flown again."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
import yaml
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import SetBool, Trigger

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.cli import main
from formation_gnc.recording import Bag, identical
from formation_gnc.records import EventKind
from formation_gnc.sil.scenario import find_scenario

from .conftest import GNC_TOPICS, PARTS, PATIENCE, Desk, answers_again, has_messages, wait_until

pytestmark = pytest.mark.sil


def test_an_unchanged_replay_of_a_graph_run_gives_the_recorded_bits(
    fly: Callable[..., Bag], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = yaml.safe_load(find_scenario("leader_follower").read_text())
    swaps = ["{at: 100.0, algorithm: coast}", "{at: 200.0, algorithm: lqr}"]
    scenario["/**/controller"]["ros__parameters"]["schedule"] = swaps
    (tmp_path / "swaps.yaml").write_text(yaml.safe_dump(scenario))
    recorded = fly("--duration", "300", scenario=str(tmp_path / "swaps.yaml"))
    assert main(["replay", str(recorded.path), "--bag", str(tmp_path / "again")]) == 0
    again = Bag(tmp_path / "again")
    assert list(again.arrays("/events")["kind"]).count(EventKind.PARAMETERS) == 2
    assert again.topics["/deputy1/timing"].count == 1200, "of every part at every tick"
    assert identical(recorded, again, gnc_topics(recorded)) == []


def test_a_flight_with_faults_has_its_bits_on_graph_in_process_and_again(
    fly: Callable[..., Bag], tmp_path: Path
) -> None:
    scenario = yaml.safe_load(find_scenario("leader_follower").read_text())
    scenario["/plant"]["ros__parameters"]["faults"] = [
        "{at: 50.0, until: 200.0, deputy: deputy1, fault: drift, sensor: radius, rate: 0.5}",
        "{at: 60.0, deputy: deputy1, fault: outliers, sensor: latitude, share: 0.2}",
        "{at: 70.0, deputy: deputy1, fault: stuck_on, force: [0.002, 0.0, 0.0], told: false}",
        "{at: 80.0, until: 150.0, deputy: deputy1, fault: chief_drift, rate: [0.0, 0.5, 0.0]}",
        "{at: 100.0, until: 180.0, deputy: deputy1, fault: freeze, sensor: range_rate}",
    ]
    # what monitors find is their own affair: here one of them isolates, returns and switches, and modes are commanded
    scenario["/**/supervisor"] = {
        "ros__parameters": {
            "fault_table": [
                "{monitor: frozen_readings, response: isolate_sensor, return: 20}",
                "{monitor: frozen_readings, response: switch_law, laws: [sdre], return: 40}",
            ],
            "schedule": ["{at: 20.0, mode: standby}", "{at: 40.0, mode: safe}", "{at: 60.0, mode: acquire}"],
        }
    }
    path = tmp_path / "faults.yaml"
    path.write_text(yaml.safe_dump(scenario))
    recorded = fly("--duration", "300", scenario=str(path))
    assert list(recorded.arrays("/events")["kind"]).count(EventKind.FAULT) == 8
    modes, restricted = (
        recorded.arrays("/deputy1/mode")["mode"],
        recorded.arrays("/deputy1/mode")["restrictions.0.subject"],
    )
    assert list(modes[[0, 20, 40, 60]]) == ["acquire", "standby", "safe", "acquire"]
    assert set(filter(None, restricted)) == {"range_rate", "sdre"}
    assert set(recorded.arrays("/deputy1/status")["algorithm"]) == {"lqr", "sdre"}
    inside, again = tmp_path / "inside", tmp_path / "again"
    assert main(["sil", str(path), "--duration", "300", "--in-process", "--bag", str(inside), "--accept-lost"]) == 0
    assert main(["replay", str(recorded.path), "--bag", str(again)]) == 0
    for other in (inside, again):
        assert identical(recorded, Bag(other), [*gnc_topics(recorded), "/events"]) == []


def test_a_state_begun_anew_has_its_bits_on_graph_and_again(fly: Callable[..., Bag], tmp_path: Path) -> None:
    """Two sensors off at once: the state is given up, and a fix taken; the chief's ephemeris is isolated besides."""
    scenario = yaml.safe_load(find_scenario("leader_follower").read_text())
    scenario["/plant"]["ros__parameters"]["faults"] = [
        "{at: 60.0, deputy: deputy1, fault: chief_drift, rate: [0.0, 1.0, 0.0]}",
        "{at: 105.0, until: 156.0, deputy: deputy1, fault: bias, sensor: radius, value: 20.0}",
        "{at: 105.0, until: 156.0, deputy: deputy1, fault: bias, sensor: range_rate, value: 0.04}",
    ]
    scenario["/**/supervisor"] = {"ros__parameters": {"schedule": ["{at: 250.0, mode: acquire}"]}}
    path = tmp_path / "anew.yaml"
    path.write_text(yaml.safe_dump(scenario))
    recorded = fly("--duration", "300", "--set", "plant.deadline=10.0", scenario=str(path))
    restricted = recorded.arrays("/deputy1/mode")["restrictions.0.subject"]
    assert "chief" in restricted
    given_up = [
        each for each in recorded.arrays("/events")["detail"] if "the supervisor does not trust the state" in each
    ]
    assert len(given_up) == 1
    inside, again = tmp_path / "inside", tmp_path / "again"
    assert main(["sil", str(path), "--duration", "300", "--in-process", "--bag", str(inside), "--accept-lost"]) == 0
    assert main(["replay", str(recorded.path), "--bag", str(again)]) == 0
    # the tick without an estimate waits for the deadline on the graph alone, and its event says so
    topics = [each for each in gnc_topics(recorded) if each != "/events"]
    for other in (inside, again):
        assert identical(recorded, Bag(other), topics) == []


def test_nodes_restarted_with_other_parameters_replay_with_them(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    bag = desk.directory / "bag"
    plant, terminals = desk.take_off(duration=17403.0)  # s; ended by hand when all have come back
    otherwise = {
        "controller": ("/deputy1/thrust", {"algorithm": "mpc"}),
        "guidance": ("/deputy1/target", {"leader_follower.separation": 120.0}),
        "navigation": ("/deputy1/estimate", {"radius_sigma": 50.0}),
        "supervisor": ("/deputy1/mode", {"tube": 20.0}),
    }
    for flown, (kind, (answer, parameters)) in enumerate(otherwise.items(), start=1):
        wait_until(lambda topic=answer, most=100 * flown: has_messages(bag, topic, most), f"answers of the {kind}")
        terminals[kind].signal(signal.SIGKILL)
        terminals[kind].wait()
        desk.start(kind, **parameters)
        wait_until(lambda answer=answer: answers_again(bag, answer), f"the {kind} to answer again")
    plant.signal(signal.SIGINT)
    assert plant.wait() == 0
    desk.land()
    recorded = Bag(bag)
    answers = [answer for answer, _ in otherwise.values()]
    assert {topic: len(stamps) for topic, stamps in recorded.restarts(answers).items()} == dict.fromkeys(answers, 1)
    assert recorded.arrays("/deputy1/status")["algorithm"][[0, -1]].tolist() == ["lqr", "mpc"]
    assert recorded.arrays("/deputy1/target")["relative_state"][[0, -1], 1].round().tolist() == [-100, -120]
    for topic in GNC_TOPICS:  # a node that comes back goes on: it does not answer what it is told of before
        assert np.all(np.diff(recorded.arrays(topic)["stamp_ns"]) > 0), topic
    assert main(["replay", str(bag), "--bag", str(desk.directory / "again")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "identical on every GNC topic"


def call(user: Any, executor: SingleThreadedExecutor, kind: Any, service: str, request: Any) -> Any:
    client = user.create_client(kind, service)
    assert client.wait_for_service(timeout_sec=PATIENCE)
    answer = client.call_async(request)
    executor.spin_until_future_complete(answer, timeout_sec=PATIENCE)
    return answer.result()


def test_the_replay_node_plays_in_step_with_real_nodes_to_the_same_bits(
    desk: Desk, fly: Callable[..., Bag], tmp_path: Path
) -> None:
    played = fly("--duration", "200", "--in-process", directory=tmp_path / "played")
    bag = desk.directory / "again"
    recorder = desk.start("recorder", bag=bag)
    parts = [desk.start(kind) for kind in PARTS]
    player = desk.start("replay", bag=played.path, paused=True)
    context = Context()
    rclpy.init(context=context, domain_id=desk.domain)
    user = rclpy.create_node("user", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(user)
    heard = {"measurement": 2, "estimate": 3, "target": 2, "thrust": 2, "status": 1}
    try:
        wait_until(
            lambda: all(user.count_subscribers(f"/deputy1/{each}") >= n for each, n in heard.items()),
            "everybody to listen",
        )
        step = call(user, executor, Trigger, "/replay/step", Trigger.Request())
        assert step.success
        assert step.message == "played 0 s"
        wait_until(lambda: all(has_messages(bag, topic) for topic in GNC_TOPICS), "everybody joined to the recorder")
        assert call(user, executor, SetBool, "/replay/pause", SetBool.Request(data=False)).message == "playing"
    finally:
        user.destroy_node()
        rclpy.shutdown(context=context)
    assert player.wait() == 0, player.text
    for terminal in (*parts, recorder):
        terminal.signal(signal.SIGINT)
        assert terminal.wait() == 0, terminal.text
    assert identical(played, Bag(bag), GNC_TOPICS) == []


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "parameter bag: missing"),
        ({"bag": "/nowhere"}, "/nowhere"),
        ({"bag": ".", "start": 5.0, "end": 5.0}, "parameter end: 5.0 is not allowed; it must be above start"),
    ],
)
def test_the_replay_node_rejects_what_it_cannot_play(desk: Desk, parameters: dict[str, object], said: str) -> None:
    terminal = desk.start("replay", **parameters)
    assert terminal.wait() == 2
    (line,) = [line for line in terminal.text.splitlines() if line.strip()]
    assert said in line
