"""The wheel: what it holds, and that it flies where there is nothing but Python and its packages."""

import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from importlib.metadata import version
from pathlib import Path

import pytest
import setuptools

from formation_gnc.recording import Bag
from formation_gnc.sil.recorded_flight import fly
from formation_gnc.sil.scenario import load_scenario

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("dist")
    command = [ROOT / "tools/make_wheel.sh", sys.executable, directory]
    subprocess.run(command, check=True, capture_output=True)
    (path,) = directory.iterdir()
    return path


@pytest.fixture(scope="module")
def contents(wheel: Path) -> dict[str, str]:
    """Text of every file of the wheel, by path."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name).decode() for name in archive.namelist()}


def asked(contents: dict[str, str]) -> set[str]:
    """Names of the packages that the wheel depends on."""
    stated = Parser().parsestr(part(contents, "METADATA")).get_all("Requires-Dist", [])
    return {re.split(r"[<>=;]", each)[0] for each in stated if "extra" not in each}


def part(contents: dict[str, str], name: str) -> str:
    """A file of the wheel's metadata."""
    return next(text for path, text in contents.items() if path.endswith(f".dist-info/{name}"))


@pytest.mark.thorough
def test_it_holds_every_file_of_the_package_and_what_is_shared(contents: dict[str, str]) -> None:
    there = (path for path in ROOT.glob("formation_gnc/**/*") if path.is_file() and "__pycache__" not in path.parts)
    own = {path.relative_to(ROOT).as_posix() for path in there}
    files = [*ROOT.glob("params/*.yaml"), *ROOT.glob("campaigns/*.yaml")]
    shared = {f"formation_gnc/{path.parent.name}/{path.name}": path for path in files}
    shared |= {f"formation_gnc_msgs/msg/{path.name}": path for path in ROOT.glob("msg_defs/msg/*.msg")}
    standard = ROOT / "msg_defs/standard"
    shared |= {path.relative_to(standard).as_posix(): path for path in standard.glob("*/msg/*.msg")}
    packed = {path for path in contents if ".dist-info/" not in path}
    assert packed == own | {f"formation_gnc/share/{place}" for place in shared}
    for place, path in shared.items():
        assert contents[f"formation_gnc/share/{place}"] == path.read_text()


@pytest.mark.thorough
def test_it_puts_the_command_on_path_and_no_node(contents: dict[str, str]) -> None:
    entry_points = part(contents, "entry_points.txt")
    assert entry_points.split() == ["[console_scripts]", "formation-gnc", "=", "formation_gnc.cli:main"]


@pytest.mark.thorough
def test_it_asks_for_the_packages_of_the_flight_software(contents: dict[str, str]) -> None:
    metadata = Parser().parsestr(part(contents, "METADATA"))
    assert metadata["Requires-Python"] == ">=3.12"
    listed = (ROOT / "requirements.in").read_text()
    section = listed.split("# Flight software and its command\n")[1].split("\n\n")[0]
    listed_there = {re.split(r"[ <=]", line)[0] for line in section.splitlines()}
    assert asked(contents) == listed_there - {"pillow"}  # Matplotlib asks for it


def test_colcon_gets_the_nodes_and_what_it_got_before(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, object] = {}
    monkeypatch.setattr(setuptools, "setup", given.update)
    monkeypatch.setattr(sys, "argv", ["setup.py", "develop"])
    monkeypatch.chdir(ROOT)
    runpy.run_path("setup.py")
    scripts = given["entry_points"]["console_scripts"]  # type: ignore[index]
    assert {"plant = formation_gnc.nodes.plant:main", "navigation = formation_gnc.nodes.module:main"} < set(scripts)
    assert given["install_requires"] == ["setuptools"]
    assert not any(".share" in package for package in given["packages"])  # type: ignore[attr-defined]


def interpreters() -> Iterator[str]:
    """Python 3.12 and 3.13, where there are such."""
    yield sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    candidates = [shutil.which("python3.13"), *pyenv.glob("versions/3.13*/bin/python")]
    if uv := shutil.which("uv"):
        found = subprocess.run([uv, "python", "find", "3.13"], capture_output=True, text=True)
        candidates.append(found.stdout.strip())
    for candidate in filter(None, candidates):
        asked = subprocess.run([candidate, "-c", "import sys, venv; print(sys.version_info[1])"], capture_output=True)
        if asked.stdout == b"13\n":  # a shim of pyenv fails
            yield str(candidate)
            return


@pytest.mark.slow
@pytest.mark.parametrize("python", list(interpreters()), ids=lambda path: Path(path).name)
def test_it_flies_records_reports_and_runs_a_campaign(
    python: str, wheel: Path, contents: dict[str, str], tmp_path: Path
) -> None:
    """In a clean environment, outside of the repository, to the bits of a flight from the repository."""

    def run(*command: object) -> str:
        done = subprocess.run(
            list(map(str, command)),
            cwd=tmp_path,
            env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    run(python, "-m", "venv", "venv")
    (tmp_path / "here.txt").write_text("".join(f"{name}=={version(name)}\n" for name in asked(contents)))
    pip = [tmp_path / "venv/bin/pip", "--disable-pip-version-check"]
    reached = subprocess.run([*pip, "download", "-q", "--no-deps", "-d", tmp_path / "reached", "mcap"])
    if reached.returncode:
        pytest.skip("no package registry within reach")
    run(*pip, "install", "-q", "-c", "here.txt", wheel)
    command = tmp_path / "venv/bin/formation-gnc"
    flown = run(command, "sil", "leader_follower", "--in-process", "--duration", 60, "--bag", "bag", "--json")
    assert json.loads(flown)["ticks"] == 60
    run(command, "report", "bag")
    assert "identical on every GNC topic" in run(command, "replay", "bag", "--bag", "again")
    requirement = "nearest approach > 50 in 50 % at 50 % confidence"
    campaign = f"scenario: leader_follower\nset:\n  plant.duration: 60.0\nrequirements:\n  - {requirement}\n"
    (tmp_path / "short.yaml").write_text(campaign)
    run(command, "campaign", "short.yaml", "--runs", 4, "--workers", 1)
    bag = Bag(tmp_path / "bag")
    ours = fly(load_scenario("leader_follower", {"/plant": {"duration": 60.0}}), tmp_path / "ours")
    for topic in ours.topics:
        assert list(bag.messages([topic])) == list(ours.messages([topic])), topic
