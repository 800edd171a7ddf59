"""What the node graph recorded, flown again."""

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.cli import main
from formation_gnc.recording.reader import Bag, identical
from formation_gnc.sil.scenario import find_scenario

from .conftest import Sil

pytestmark = pytest.mark.sil


def test_an_unchanged_replay_of_a_graph_run_gives_the_recorded_bits(
    sil: Callable[..., Sil], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = yaml.safe_load(find_scenario("leader_follower").read_text())
    swaps = ["{at: 100.0, algorithm: coast}", "{at: 200.0, algorithm: lqr}"]
    scenario["/**/controller"]["ros__parameters"]["schedule"] = swaps
    (tmp_path / "swaps.yaml").write_text(yaml.safe_dump(scenario))
    run = sil("--duration", "300", scenario=str(tmp_path / "swaps.yaml"))
    assert run.finish()[0] == 0
    assert main(["replay", str(run.bag), "--bag", str(tmp_path / "again")]) == 0
    recorded, again = Bag(run.bag), Bag(tmp_path / "again")
    assert list(again.arrays("/events")["kind"]).count("parameters") == 2
    assert again.topics["/deputy1/timing"].count == 900, "of every part at every tick"
    assert identical(recorded, again, gnc_topics(recorded)) == []
