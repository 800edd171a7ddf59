"""The node graph as real processes over real DDS."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from formation_gnc.cli import main
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.recording import Bag, identical
from formation_gnc.records import EventKind

from .conftest import GNC_TOPICS, PARTS, PATIENCE, Desk, Sil, has_messages, set_parameter, wait_until

pytestmark = pytest.mark.sil

StartSil = Callable[..., Sil]


def events(bag: Path, kind: EventKind) -> list[tuple[int, str]]:
    """Ticks and details of the events of one kind in a bag."""
    recorded = Bag(bag).arrays("/events")
    return [
        (int(tick), str(detail))
        for tick, each, detail in zip(recorded["tick"], recorded["kind"], recorded["detail"], strict=True)
        if each == kind
    ]


def test_nodes_started_by_hand_in_any_order_fly_and_swap_the_law_in_flight(desk: Desk) -> None:
    bag = desk.directory / "bag"
    options = {
        # slow enough for a person to type in flight, on a busy machine too: 20 s of wall time
        "plant": {"duration": 600.0, "real_time_factor": 30.0, "wait_for_recorder": True},
        "recorder": {"bag": bag},
    }
    kinds = ["plant", "recorder", *PARTS]
    random.shuffle(kinds)
    terminals = {kind: desk.start(kind, by_hand=True, **options.get(kind, {})) for kind in kinds}
    wait_until(lambda: has_messages(bag, "/deputy1/thrust", 20), f"the first commands of {kinds}")
    accepted, reason = set_parameter(desk.domain, "/deputy1/controller", "algorithm", "coast")
    assert accepted, reason
    rejected, reason = set_parameter(desk.domain, "/deputy1/controller", "algorithm", "magic")
    assert not rejected
    assert "magic" in reason
    assert "coast, " in reason, "the reason says what is allowed"
    assert terminals["plant"].wait() == 0
    for kind in (*PARTS, "recorder"):
        terminals[kind].signal(signal.SIGINT)
        assert terminals[kind].wait() == 0, terminals[kind].text

    recorded = Bag(bag)
    assert {recorded.topics[topic].count for topic in GNC_TOPICS} == {600}, "no message missed or repeated"
    ((tick, detail),) = events(bag, EventKind.PARAMETERS)
    assert detail == "algorithm: lqr -> coast"
    status, thrust = recorded.arrays("/deputy1/status"), recorded.arrays("/deputy1/thrust")
    assert list(status["algorithm"]) == ["lqr"] * tick + ["coast"] * (600 - tick)
    # no jump: a tenth of the 10 mN limit per tick, so that ten ticks after the swap nothing is left
    steps = np.abs(np.diff(thrust["force"][tick - 1 : tick + 11], axis=0))
    assert steps.max() <= 0.001 * (1.0 + 1e-12)
    assert np.any(thrust["force"][tick - 1] != 0.0)
    assert np.all(thrust["force"][tick + 10 :] == 0.0)
    for topic in GNC_TOPICS:
        assert np.array_equal(recorded.arrays(topic)["stamp_ns"], np.arange(600) * 1_000_000_000)


@pytest.fixture
def load() -> Iterator[None]:
    """Every core busy with something else."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
    yield
    for burner in burners:
        burner.kill()
        burner.wait()


@pytest.mark.slow  # a flight of minutes on a busy machine
def test_law_swaps_under_load_miss_no_tick_and_keep_the_step_bound(desk: Desk, load: None) -> None:
    bag = desk.directory / "bag"
    desk.start("recorder", bag=bag)
    plant = desk.start("plant", duration=10_000.0, real_time_factor=100.0, wait_for_recorder=True)
    terminals = {kind: desk.start(kind) for kind in PARTS}
    wait_until(lambda: "acquired" in terminals["navigation"].text, "the first estimate")
    laws = ["lqr", *("hinf", "mpc", "hinf", "lqr") * 2]
    for law in laws[1:]:
        accepted, reason = set_parameter(desk.domain, "/deputy1/controller", "algorithm", law)
        assert accepted, reason
    wait_until(lambda: terminals["controller"].text.count(" handover: ") == 8, "the last hand-over")
    assert plant.process.poll() is None, "the flight was too short for all swaps"
    for terminal in (plant, *terminals.values(), desk.terminals[0]):
        terminal.signal(signal.SIGINT)
        assert terminal.wait() == 0, terminal.text

    recorded = Bag(bag)
    assert events(bag, EventKind.MISS) == []
    assert events(bag, EventKind.FALLBACK) == []
    thrust, status = recorded.arrays("/deputy1/thrust"), recorded.arrays("/deputy1/status")
    ticks = len(thrust["stamp_ns"])
    assert np.array_equal(thrust["stamp_ns"], np.arange(ticks) * 1_000_000_000)
    assert ticks >= recorded.topics["/truth"].count - 1, "the plant may be stopped within a tick"
    handovers = events(bag, EventKind.HANDOVER)
    assert [detail.split(":")[0] for _, detail in handovers] == [f"from {law}" for law in laws[:-1]]
    at = [tick for tick, _ in handovers]
    assert list(status["algorithm"]) == [
        law for law, begin, end in zip(laws, [0, *at], [*at, ticks], strict=True) for _ in range(begin, end)
    ]
    # a tenth of the 10 mN limit
    steps = np.abs(np.diff(thrust["force"], axis=0)).max(axis=1)
    assert (steps[np.array(at) - 1] <= 0.001 * (1.0 + 1e-12)).all()


def test_a_restarted_node_rejoins_and_its_gap_is_logged_and_replays(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = desk.directory / "bag"
    plant, terminals = desk.take_off()
    time.sleep(2.0)
    before = plant.text.count(": miss: ")  # by the load of the machine
    terminals["navigation"].signal(signal.SIGKILL)
    wait_until(lambda: plant.text.count(": miss: ") > before, "the plant to miss the navigation")
    desk.start("navigation")
    assert plant.wait() == 0
    desk.land()

    misses = events(bag, EventKind.MISS)
    assert misses
    assert misses[0][1].startswith("did not answer within 3 s")
    recorded = Bag(bag)
    answered = set(recorded.arrays("/deputy1/thrust")["stamp_ns"] // 1_000_000_000)
    unanswered = set(range(900)) - answered
    assert unanswered, "what was asked of the navigation when it was dead"
    assert unanswered <= {tick for tick, _ in misses}, "all logged; an answer that came too late is recorded besides"
    assert 899 in answered
    # the restarted filter started from a fix and is consistent: the whole error is inside what it believes
    acquired = [tick for tick, _ in events(bag, EventKind.ACQUIRED)]
    assert len(acquired) >= 2
    assert misses[0][0] < acquired[-1] < 900
    estimate, truth = recorded.arrays("/deputy1/estimate"), recorded.arrays("/truth")
    error = estimate["relative_state"][-1] - truth["deputies.0.relative_state"][-1]
    covariance = estimate["covariance"][-1].reshape(6, 6)
    nees = error @ np.linalg.solve(covariance, error)
    assert nees < 27.9  # chi-square of 6 degrees of freedom, probability 1e-4
    # and what was recorded of all that is flown again to the same bits
    assert main(["replay", str(bag), "--bag", str(desk.directory / "again")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "identical on every GNC topic"


def test_every_law_has_the_same_bits_on_graph_and_in_process(fly: Callable[..., Bag], tmp_path: Path) -> None:
    """One after the other; the first with a final time flies its reconfiguration to the end, and holds."""
    laws = list(ALGORITHMS)
    weights = {"position_error": [10.0] * 3, "velocity_error": [0.1] * 3, "thrust": [0.002] * 3}
    scenario = yaml.safe_load((Desk(tmp_path, 0).parameters).read_text())
    controller = scenario["/**/controller"]["ros__parameters"]
    weighted = [law for law in laws if weights.keys() <= ALGORITHMS[law].Parameters.__dataclass_fields__.keys()]
    controller |= {law: controller.get(law, {}) | weights for law in weighted}
    laws.remove("sdre_finite")
    laws.insert(0, "sdre_finite")
    controller["algorithm"] = laws[0]
    controller["sdre_finite"]["final_time"] = 1500.0
    begins = [0, *(1700 + 150 * index for index in range(len(laws)))]
    controller["schedule"] = [
        f"{{at: {begin}.0, algorithm: {law}}}" for law, begin in zip(laws[1:], begins[1:], strict=False)
    ]
    (tmp_path / "laws.yaml").write_text(json.dumps(scenario))  # YAML too, without the aliases that ROS rejects
    bags = []
    for name, extra in (("graph", []), ("process", ["--in-process"])):
        duration, scenario_file = str(begins[-1]), str(tmp_path / "laws.yaml")
        bags.append(fly("--duration", duration, *extra, directory=tmp_path / name, scenario=scenario_file))
    assert identical(*bags, [*GNC_TOPICS, "/events"]) == []
    assert [tick for tick, _ in events(bags[0].path, EventKind.PARAMETERS)] == begins[1:-1]
    assert events(bags[0].path, EventKind.MISS) == []
    assert events(bags[0].path, EventKind.FALLBACK) == []
    status_of = bags[0].arrays("/deputy1/status")
    assert list(status_of["algorithm"]) == [
        law for law, begin, end in zip(laws, begins, begins[1:], strict=False) for _ in range(begin, end)
    ]
    solver = list(status_of["solver"])
    assert [tick for tick in range(1500) if solver[tick] == "planned"] == list(range(0, 901, 120))
    assert set(solver[1500:1700]) == {"holding"}
    truth, target = bags[0].arrays("/truth"), bags[0].arrays("/deputy1/target")
    error = truth["deputies.0.relative_state"] - target["relative_state"]
    distance = np.linalg.norm(error[:, :3], axis=1)
    assert distance[0] > 15.0
    # what the estimate is off by, and grows to from the last plan on: 2 m; and none loses the formation
    assert distance[1500:].max() < 8.0


def test_two_runs_at_once_do_not_hear_each_other(sil: StartSil, tmp_path: Path) -> None:
    options = ("--json", "--duration", "300")
    runs = [sil(*options, "--seed", seed, directory=tmp_path / seed) for seed in ("1", "2")]
    summaries = []
    for run in runs:
        status, output, errors = run.finish(2 * PATIENCE)
        assert status == 0, errors
        summaries.append(json.loads(output))
    for summary in summaries:
        assert summary["ticks"] == 300
        assert summary["misses"] == 0
    assert summaries[0]["deputies"] != summaries[1]["deputies"]
    for run in runs:
        assert {Bag(run.bag).topics[topic].count for topic in GNC_TOPICS} == {300}


def test_interrupt_stops_all_sooner_than_they_started_and_closes_the_bag(sil: StartSil) -> None:
    """Starting imports, a matter of seconds of processor time, however busy the machine: a clock of its own."""
    started = time.monotonic()
    run = sil("--real-time-factor", "200")
    run.wait_for_flight()
    children = run.children()
    assert set(children) == {"plant", "recorder", *PARTS}
    interrupted = time.monotonic()
    os.killpg(run.process.pid, signal.SIGINT)
    status, _, errors = run.finish()
    assert time.monotonic() - interrupted < interrupted - started
    assert status == 130
    assert errors.strip().splitlines()[-1] == f"formation-gnc: interrupted; bag closed: {run.bag}"
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())
    recorded = Bag(run.bag)
    assert recorded.damage is None
    assert recorded.topics["/truth"].count > 0


@pytest.mark.parametrize("victim", ["navigation", "plant", "recorder"])
def test_a_node_that_dies_ends_the_run_and_is_named(sil: StartSil, victim: str) -> None:
    run = sil("--real-time-factor", "200")
    run.wait_for_flight()
    children = run.children()
    os.kill(children[victim], signal.SIGKILL)
    status, _, errors = run.finish()
    assert status == 1
    last = errors.strip().splitlines()[-1]
    assert f"{victim} ended: killed by SIGKILL" in last
    assert str(run.bag) in last
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())
    assert Bag(run.bag).topics["/truth"].count > 0, "what was recorded is readable"


def test_a_node_that_dies_is_started_again_where_asked(sil: StartSil) -> None:
    run = sil("--respawn", "--real-time-factor", "40", "--duration", "300")
    wait_until(lambda: has_messages(run.bag, "/deputy1/target"), "the first target on disk")
    os.kill(run.children()["guidance"], signal.SIGKILL)
    status, _, errors = run.finish()
    assert status == 0, errors
    assert "/deputy1/guidance ended: killed by SIGKILL" in errors
    assert "started again" in errors
    assert Bag(run.bag).topics["/truth"].count == 300
    assert Bag(run.bag).restarts(["/deputy1/target"])["/deputy1/target"]


def test_the_nodes_end_when_the_command_is_killed(sil: StartSil) -> None:
    run = sil("--real-time-factor", "200")
    run.wait_for_flight()
    children = run.children()
    os.kill(run.process.pid, signal.SIGKILL)
    processes = [Path(f"/proc/{pid}") for pid in children.values()]
    wait_until(lambda: not any(process.exists() for process in processes), "all nodes to end")
    assert Bag(run.bag).damage is None


@pytest.mark.parametrize(
    ("kind", "parameter", "said"),
    [
        ("plant", {"deadlin": 1.0}, "parameter deadlin: unknown; did you mean deadline?"),
        ("plant", {"tick": -1.0}, "parameter tick: -1.0 is not allowed; it must be above 0"),
        ("controller", {"algorithm": "magic"}, "algorithm: 'magic' is not allowed; it must be one of coast"),
        ("navigation", {"latitude_sigma": ".nan"}, "latitude_sigma: nan is not allowed; it must be finite"),
        ("guidance", {"formation": 3}, "formation: 3 is not allowed; it must be a value of type string"),
        ("recorder", {"bag": "/proc"}, "/proc"),
    ],
)
def test_a_node_rejects_a_wrong_parameter_in_one_line_with_status_2(
    desk: Desk, kind: str, parameter: dict[str, object], said: str
) -> None:
    terminal = desk.start(kind, by_hand=True, **parameter)
    assert terminal.wait() == 2
    # `ros2 run` adds a line of its own
    (line,) = [line for line in terminal.text.splitlines() if line.strip() and not line.startswith("[ros2run]")]
    assert line.startswith(f"{kind}: ")
    assert said in line


def test_a_node_rejects_an_unreadable_parameter_file(desk: Desk) -> None:
    desk.parameters = desk.directory / "missing.yaml"
    terminal = desk.start("guidance")
    assert terminal.wait() == 2
    assert "missing.yaml" in terminal.text
    assert "Traceback" not in terminal.text
