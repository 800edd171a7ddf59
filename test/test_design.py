"""`formation-gnc design`: output, plot and rejections."""

import json
from pathlib import Path

import pytest

from formation_gnc.cli import main
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.sil.scenario import find_scenario


@pytest.mark.parametrize("law", ALGORITHMS)
def test_a_design_is_one_json_object_with_the_figures_of_the_law(law: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "leader_follower", "--controller", law, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["scenario"], printed["deputy"], printed["algorithm"]) == ("leader_follower", "deputy1", law)
    assert all(real < 0.0 for real, _ in printed["poles_1_s"]), "every law stabilises"
    expected = {
        "lqr": {"gain [N/m, N/(m/s), N/(m s)]", "phase margin [deg]"},
        "hinf": {"optimal gamma", "gamma", "largest S", "largest T", "gain margin, up"},
        "mpc": {"horizon [s]", "variables", "constraints"},
    }
    assert set(printed["figures"]) >= expected.get(law, set())


@pytest.mark.thorough
def test_a_design_is_printed_and_plotted_without_a_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["design", "geostationary", "--controller", "hinf", "--plot", "hinf.png"]) == 0
    printed = capsys.readouterr().out
    for words in ("geostationary, deputy1: hinf", "optimal gamma", "phase margin", "closed-loop poles"):
        assert words in printed
    assert printed.endswith("plot: hinf.png\n")
    assert [path.name for path in tmp_path.iterdir()] == ["hinf.png"]
    assert Path("hinf.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["nowhere"], "scenario nowhere: unknown; it must be"),
        (
            ["leader_follower", "--controller", "pid"],
            "algorithm: 'pid' is not allowed; it must be one of coast",
        ),
        (["leader_follower", "--deputy", "chief"], "deputy chief: not in leader_follower; it has deputy1"),
        (["leader_follower", "--plot", "design.txt"], "it must be a .png, .pdf or .svg file"),
        (["leader_follower", "--plot", "nowhere/design.png"], "plot nowhere/design.png: No such file"),
        (["bad.yaml", "--controller", "lqr"], "/deputy1/controller: lqr: the state weight has a normalised"),
        (["bad.yaml", "--controller", "mpc"], "/deputy1/controller: mpc: step is 0.5 s; it must be a whole"),
        (["bad.yaml", "--controller", "hinf"], "/deputy1/controller: hinf: the plant has poles on the imag"),
    ],
)
@pytest.mark.thorough
def test_an_impossible_design_is_rejected_in_one_line(
    options: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    indefinite = [-1.0 if row == column else 0.0 for row in range(6) for column in range(6)]
    own = f"lqr.state_weight: {indefinite}, mpc.step: 0.5, hinf.disturbance: 0.0"
    default = find_scenario("leader_follower").read_text()
    Path("bad.yaml").write_text(f"{default}\n/*/controller: {{ros__parameters: {{{own}}}}}\n")
    assert main(["design", *options]) == 2
    output, errors = capsys.readouterr()
    assert (output, errors.count("\n")) == ("", 1)
    assert words in errors
