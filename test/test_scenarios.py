"""Every scenario in params/, shortened, flies and replays."""

import json
from pathlib import Path

import pytest

from formation_gnc.cli import main
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.recording.reader import Bag
from formation_gnc.sil.scenario import find_scenario, load_scenario

pytestmark = pytest.mark.usefixtures("without_pictures")

SCENARIOS = sorted(path.stem for path in find_scenario("leader_follower").parent.glob("*.yaml"))
TICKS = 30


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.thorough
def test_every_scenario_replays_to_the_recorded_bits(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the command means to own its process
    duration = TICKS * load_scenario(name).plant.tick
    bag = tmp_path / "bag"
    status = main(["sil", name, "--in-process", "--json", "--duration", str(duration), "--bag", str(bag)])
    assert status == 0
    assert json.loads(capsys.readouterr().out)["ticks"] == TICKS
    assert main(["replay", str(bag), "--bag", str(tmp_path / "again")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "identical on every GNC topic"
    counts = [{name: topic.count for name, topic in Bag(path).topics.items()} for path in (bag, tmp_path / "again")]
    assert counts[0] == counts[1]
    every_tick = [topic for topic in counts[0] if not topic.endswith(("/events", "/separation", "/health"))]
    assert min(counts[0][topic] for topic in every_tick) == TICKS


@pytest.mark.thorough
def test_a_flight_in_another_air_under_another_sky_replays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    models = ["drag=true", "density_model=nrlmsis", "sun=true", "moon=true", "ephemeris=de421"]
    forces = [word for model in models for word in ("--set", f"plant.forces.{model}")]
    bag = tmp_path / "bag"
    assert main(["sil", "leader_follower", "--in-process", "--duration", "30", "--bag", str(bag), *forces]) == 0
    assert main(["replay", str(bag), "--bag", str(tmp_path / "again")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "identical on every GNC topic"


@pytest.mark.parametrize("name", SCENARIOS)
def test_laws_with_quadratic_weights_have_those_of_lqr(name: str) -> None:
    """They are compared with one another: `verification/laws.py`."""
    for setup in load_scenario(name).deputies.values():
        laws = setup["controller"].laws
        weights = {law: own.weights() for law, own in laws.items() if isinstance(own, QuadraticWeights)}
        assert len(weights) > 6
        assert {law: each for law, each in weights.items() if each != weights["lqr"]} == {}


def test_there_are_scenarios() -> None:
    assert len(SCENARIOS) > 3
