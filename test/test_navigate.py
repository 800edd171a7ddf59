"""A recorded run through a filter again: the same filter gives the same bits, a changed one its own."""

import json
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.cli import main
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

pytest.importorskip("rclpy")


def recorded(path: Path, change_at: int = -1, **navigation: Any) -> Path:
    """Ten minutes of the default scenario with every trouble that sensors have, as a bag."""
    from formation_gnc.recording.in_process_recorder import InProcessRecorder

    trouble = {
        "deputy1.sensors.radius.dropout": 0.3,
        "deputy1.sensors.range_rate.latency": 7.0,
        "deputy1.sensors.latitude.outlier": 0.2,
        "deputy1.sensors.right_ascension.on": True,
        "deputy1.sensors.outage_start": 300.0,
        "deputy1.sensors.outage_duration": 100.0,
    }
    used = {"sensors": ["radius", "range_rate", "latitude"]}  # one less than there are
    scenario = load_scenario(
        "leader_follower", {"/plant": {"duration": 600.0, **trouble}, "/**/navigation": used | navigation}
    )
    parameters = {
        f"parameters {node}": {name: json.dumps(value) for name, value in values.items()}
        for node, values in scenario.parameters().items()
    }
    with BagWriter(path, parameters) as writer:
        sink, run = InProcessRecorder(writer), Run(scenario)
        while not run.plant.finished:
            if run.plant.tick == change_at:
                navigator = run.instances["/deputy1/navigation"].module
                navigator.commit(navigator.stage({"filter": "ukf", "gate": 6.0}))
            run.tick(sink)
    return path


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("open_loop") / "bag")


@pytest.mark.parametrize(
    ("change_at", "navigation"),
    [
        (-1, {}),
        (-1, {"filter": "ukf"}),
        (-1, {"schedule": ["{at: 200.0, filter: ukf}", "{at: 400.0, filter: ekf, gate: 4.0}"]}),
        (250, {}),
    ],
)
@pytest.mark.thorough
def test_the_unchanged_filter_gives_the_recorded_bits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change_at: int, navigation: dict[str, Any]
) -> None:
    same = navigate(capsys, recorded(tmp_path / "bag", change_at, **navigation))
    assert same["identical"]
    assert same["now"] == same["recorded"]
    assert same["now"]["rejections"]["gate"] > 0


def navigate(capsys: pytest.CaptureFixture[str], bag: Path, parameters: str = "") -> Any:
    """What `formation-gnc navigate --json` says of deputy1, with other parameters of its filter."""
    arguments = ["navigate", str(bag), "--json"]
    if parameters:
        changed = bag.with_name("changed.yaml")
        changed.write_text(f"/**/navigation:\n  ros__parameters: {parameters}\n")
        arguments += ["--params", str(changed)]
    assert main(arguments) == 0
    return json.loads(capsys.readouterr().out)["deputies"]["deputy1"]


@pytest.mark.thorough
def test_one_more_sensor_gives_other_estimates_of_the_same_flight(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = navigate(capsys, bag, "{sensors: [radius, range_rate, latitude, right_ascension]}")
    assert not more["identical"]
    assert more["now"]["readings"] > more["recorded"]["readings"]
    assert more["now"]["within_3_sigma"] > 0.95
    assert more["now"]["estimates"] == more["recorded"]["estimates"] == 600


@pytest.mark.thorough
def test_the_table_says_whether_the_bits_are_the_recorded_ones(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["navigate", str(bag)]) == 0
    assert "bit for bit" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"), [(["--deputy", "deputy9"], "deputy9"), (["--params", "missing.yaml"], "missing.yaml")]
)
def test_what_cannot_be_replayed_is_named(
    bag: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    assert main(["navigate", str(bag), *arguments]) == 2
    assert words in capsys.readouterr().err


def test_a_parameter_that_is_not_allowed_is_named(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed = bag.with_name("wrong.yaml")
    changed.write_text("/**/navigation:\n  ros__parameters: {radius_sigma: -1.0}\n")
    assert main(["navigate", str(bag), "--params", str(changed)]) == 2
    assert "radius_sigma" in capsys.readouterr().err
