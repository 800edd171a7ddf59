"""A recorded run through a filter again: the same filter gives the same bits, a changed one its own."""

import json
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.cli import main
from formation_gnc.errors import ConfigurationError
from formation_gnc.navigation.open_loop import compare
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

pytest.importorskip("rclpy")


def recorded(path: Path, change_at: int = -1, **navigation: Any) -> Path:
    """Ten minutes of the default scenario with every trouble that sensors have, as a bag."""
    from formation_gnc.transport.in_process_recorder import InProcessRecorder

    trouble = {
        "deputy1.sensors.radius.dropout": 0.3,
        "deputy1.sensors.range_rate.latency": 7.0,
        "deputy1.sensors.latitude.outlier": 0.2,
        "deputy1.sensors.right_ascension.on": True,
        "deputy1.sensors.outage_start": 300.0,
        "deputy1.sensors.outage_duration": 100.0,
    }
    scenario = load_scenario(
        "leader_follower", {"/plant": {"duration": 600.0, **trouble}, "/**/navigation": navigation}
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
def test_the_unchanged_filter_gives_the_recorded_bits(
    tmp_path: Path, change_at: int, navigation: dict[str, Any]
) -> None:
    same = compare(Bag(recorded(tmp_path / "bag", change_at, **navigation)), "deputy1", {})
    assert same.identical
    assert same.now == same.recorded
    assert same.now.rejections["gate"] > 0


def test_another_filter_gives_other_estimates_of_the_same_flight(bag: Path) -> None:
    more = compare(Bag(bag), "deputy1", {"sensors": ["radius", "range_rate", "latitude", "right_ascension"]})
    assert not more.identical
    assert more.now.readings > more.recorded.readings
    assert more.now.within_3_sigma > 0.95


def test_what_the_command_prints(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["navigate", str(bag)]) == 0
    assert "bit for bit" in capsys.readouterr().out
    changed = tmp_path / "changed.yaml"
    changed.write_text("/**/navigation:\n  ros__parameters: {radius_sigma: 50.0}\n")
    assert main(["navigate", str(bag), "--params", str(changed), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["deputies"]["deputy1"]
    assert printed["identical"] is False
    assert printed["now"]["estimates"] == printed["recorded"]["estimates"] == 600


def test_what_cannot_be_run_is_named(bag: Path) -> None:
    with pytest.raises(ConfigurationError, match="radius_sigma"):
        compare(Bag(bag), "deputy1", {"radius_sigma": -1.0})
    with pytest.raises(ConfigurationError, match="deputy9"):
        compare(Bag(bag), "deputy9", {})
