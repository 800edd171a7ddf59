"""Tutorials are run as they stand: files are saved, commands and Python blocks carried out, in their order.

Flights and campaigns are cut short, which changes their figures and nothing else; overviews are left to test/analysis.
"""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from formation_gnc.cli import main
from tools.architecture import ROOT

TUTORIALS = ROOT / "docs/tutorials"
EXAMPLE = ROOT / "examples/own_law"

BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```', re.MULTILINE | re.DOTALL)

SHORT = {"sil": ["--duration", "60"], "campaign": ["--runs", "2", "--workers", "1"]}
"""Options that go last in a command, and so before what the tutorial gives."""


def steps(tutorial: str) -> list[tuple[str, str, str]]:
    """Blocks of a tutorial: language, name of the file or "", text."""
    return BLOCK.findall((TUTORIALS / f"{tutorial}.md").read_text(encoding="utf-8"))


def commands(tutorial: str) -> Iterator[list[str]]:
    """Arguments of every command, cut short."""
    for language, _, text in steps(tutorial):
        for line in text.splitlines() if language == "bash" else ():
            program, *arguments = shlex.split(line, comments=True)
            assert program == "formation-gnc", line
            yield [*arguments, *([] if "--only" in arguments else SHORT.get(arguments[0], []))]


def save(tutorial: str, folder: Path) -> None:
    """Save the files that a tutorial has saved."""
    for _, name, text in steps(tutorial):
        if name:
            (folder / name).write_text(text)


pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_tutorial_is_run_here() -> None:
    run = set(re.findall(r"def test_(\w+)_runs", Path(__file__).read_text(encoding="utf-8")))
    assert run == {path.stem for path in TUTORIALS.glob("*.md")}


@pytest.mark.thorough
def test_first_flight_runs(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert [main(each) for each in commands("first_flight")] == [0] * 6
    assert "identical on every GNC topic" in capsys.readouterr().out
    assert {path.name for path in desk.iterdir()} == {"first", "again", "second", "difference.png"}


@pytest.mark.thorough
def test_own_scenario_runs(desk: Path) -> None:
    save("own_scenario", desk)
    assert [main(each) for each in commands("own_scenario")] == [0] * 6
    assert {path.suffix for path in (desk / "mine_export").iterdir()} == {".oem", ".czml"}


@pytest.mark.thorough
def test_a_formation_of_your_mission_runs(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save("a_formation_of_your_mission", desk)
    assert [main(each) for each in commands("a_formation_of_your_mission")] == [0] * 5
    assert capsys.readouterr().out.count("can be flown") == 2


@pytest.mark.thorough
def test_a_fault_runs(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save("a_fault", desk)
    fault = 'faults:\n      - "{at: 6000.0,'
    biased = desk / "biased.yaml"
    assert fault in biased.read_text()
    biased.write_text(biased.read_text().replace("at: 6000.0", "at: 10.0"))  # the flights are cut short
    assert [main(each) for each in commands("a_fault")] == [0] * 6
    assert "without sensor radius, for innovation_bias radius" in capsys.readouterr().out


@pytest.mark.thorough
def test_own_law_runs(desk: Path) -> None:
    save("own_law", desk)
    assert {path.name for path in desk.iterdir()} == {"own_law.py", "pyproject.toml", "test_own_law.py"}
    for file in desk.iterdir():
        assert file.read_text() == (EXAMPLE / file.name).read_text(), f"{file.name} is another in examples/own_law"
    information = desk / "own_law-0.1.0.dist-info"  # as pip would leave it
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: own-law\nVersion: 0.1.0\n")
    (information / "entry_points.txt").write_text("[formation_gnc.laws]\npd = own_law:ProportionalDerivative\n")
    code = f"from formation_gnc.cli import main; print([main(each) for each in {list(commands('own_law'))}])"
    path = os.pathsep.join([str(desk), str(ROOT), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True)
    assert "identical on every GNC topic" in done.stdout, done.stderr
    assert done.stdout.endswith("[0, 0, 0]\n"), done.stderr


@pytest.mark.slow
def test_tune_with_a_campaign_runs(desk: Path) -> None:
    save("tune_with_a_campaign", desk)
    campaign, *others = commands("tune_with_a_campaign")
    assert main(campaign) in (0, 3)  # a requirement may not be met
    assert [main(each) for each in others] == [0, 0]


@pytest.mark.thorough
def test_bag_in_a_notebook_runs(desk: Path) -> None:
    pytest.importorskip("pandas")
    names: dict[str, object] = {}
    for language, _, text in steps("bag_in_a_notebook"):
        assert language == "python"
        exec(compile(text.replace('"duration": 600.0', '"duration": 60.0'), "bag_in_a_notebook", "exec"), names)
    assert {path.name for path in desk.iterdir()} == {"flight", "coasting", "error.png", "report.html"}
