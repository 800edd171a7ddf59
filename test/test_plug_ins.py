"""What installed packages add by entry points: the example flies, and what is wrong with others is said in a line."""

import json
import os
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from formation_gnc import plugins
from formation_gnc.control.coast import Coast
from formation_gnc.control.controller import Controller
from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.provenance import provenance
from formation_gnc.supervision.monitor import Monitor

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "own_law"


def declared(monkeypatch: pytest.MonkeyPatch, *entries: tuple[str, str]) -> None:
    """Let these be the installed laws: name and value of each."""
    found = tuple(EntryPoint(name, value, "formation_gnc.laws") for name, value in entries)
    monkeypatch.setattr(plugins, "_declared", lambda: found)


def test_plug_ins_come_in_order_of_name_whatever_was_installed_first(monkeypatch):
    coast = "formation_gnc.control.coast:Coast"
    found = [EntryPoint(name, coast, "formation_gnc.laws") for name in ("zeta", "alpha")]
    monkeypatch.setattr(plugins, "entry_points", lambda: [*found, *found, EntryPoint("pytest", "x:y", "pytest11")])
    plugins._declared.cache_clear()
    try:
        assert list(plugins.load_plugins("laws", Controller, {})) == [("alpha", Coast), ("zeta", Coast)]
        assert not list(plugins.load_plugins("sensors", Controller, {}))
    finally:
        plugins._declared.cache_clear()


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("lqr", "formation_gnc.control.coast:Coast", r"the name is taken in formation_gnc\.laws; choose another"),
        ("own", "no_such_module:Law", "cannot be imported: ModuleNotFoundError: No module named 'no_such_module'"),
        ("own", "formation_gnc.control.coast:Missing", "cannot be imported: AttributeError"),
        ("own", "formation_gnc.common:Orbit", r"must be a formation_gnc\.control\.controller\.Controller"),
        ("own", "formation_gnc.types:NANOSECONDS", r"must be a formation_gnc\.control\.controller\.Controller"),
    ],
)
def test_a_plug_in_that_cannot_be_used_is_refused(name, value, reason, monkeypatch):
    declared(monkeypatch, (name, value))
    with pytest.raises(ConfigurationError, match=rf"plug-in {name} \({value}\): {reason}"):
        list(plugins.load_plugins("laws", Controller, {"lqr"}))


def test_two_packages_cannot_bring_the_same_name(monkeypatch):
    coast = "formation_gnc.control.coast:Coast"
    declared(monkeypatch, ("own", coast), ("own", "formation_gnc.control.lqr:LinearQuadraticRegulator"))
    with pytest.raises(ConfigurationError, match=r"plug-in own .*: the name is taken"):
        list(plugins.load_plugins("laws", Controller, {}))


def test_a_plug_in_with_another_name_than_its_entry_is_refused(monkeypatch):
    found = (EntryPoint("cold", "formation_gnc.supervision.monitors.mass:Mass", "formation_gnc.monitors"),)
    monkeypatch.setattr(plugins, "_declared", lambda: found)
    with pytest.raises(ConfigurationError, match=r"plug-in cold \(.*\): its name is 'mass'; both must be the same"):
        list(plugins.load_plugins("monitors", Monitor, {}))


def test_monitors_and_figures_join_their_registries(tmp_path):
    (tmp_path / "own_health.py").write_text(
        "from formation_gnc.api import DeputyPanel, Monitor\n"
        "class Cold(Monitor):\n"
        "    name, title, test = 'cold', 'temperature', 'bound'\n"
        "    def feed(self, observation): self.judge('', 2.0, 0.5, 1.0)\n"
        "FIGURE = DeputyPanel('thermal', lambda history: [])\n"
    )
    info = tmp_path / "own_health-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own-health\nVersion: 1.0\n")
    entries = "[formation_gnc.monitors]\ncold = own_health:Cold\n[formation_gnc.figures]\nthermal = own_health:FIGURE\n"
    (info / "entry_points.txt").write_text(entries)
    look = (
        "from formation_gnc.analysis.panels.registry import DEPUTY_PANELS;"
        "from formation_gnc.api import Run, load_scenario;"
        "print(DEPUTY_PANELS[-1].name);"
        "table = ['{monitor: cold, response: go_to, mode: safe}'];"
        "run = Run(load_scenario('leader_follower', {'/**/supervisor': {'fault_table': table}}));"
        "found = [];"
        "[run.tick(lambda topic, record: found.append((topic, record))) for _ in range(15)];"
        "print([str(record) for topic, record in found if topic == '/events' and 'cold' in str(record)])"
    )
    path = os.pathsep.join([str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", look]
    output = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    name, events = output.stdout.splitlines()
    assert name == "thermal"
    assert "cold: 2, where 1 is the limit" in events
    assert "safe" in events


def test_the_provenance_names_no_plug_in_where_there_is_none(monkeypatch):
    declared(monkeypatch)
    assert "own-law" not in provenance()["versions"]


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment in which the example is installed."""
    source, place = tmp_path_factory.mktemp("source") / "own_law", tmp_path_factory.mktemp("site")
    shutil.copytree(EXAMPLE, source)  # the build leaves its files beside the source
    pip = [sys.executable, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    options = ["--no-build-isolation", "--no-deps", "--target", str(place), str(source)]
    subprocess.run([*pip, *options], check=True, capture_output=True)
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(place), str(ROOT), os.environ.get("PYTHONPATH", "")])}


def formation_gnc(environment: dict[str, str], *arguments: Any) -> subprocess.CompletedProcess[str]:
    """Result of a command of `formation-gnc`."""
    command = [sys.executable, "-c", "import sys, formation_gnc.cli; sys.exit(formation_gnc.cli.main())"]
    return subprocess.run([*command, *map(str, arguments)], env=environment, capture_output=True, text=True)


@pytest.mark.sil
def test_the_law_of_the_example_is_swapped_to_in_flight_and_replays(example, tmp_path):
    pytest.importorskip("rclpy")
    swap = "controller.schedule=['{at: 20.0, algorithm: pd, pd.damping: 0.7}']"
    options = ("--duration", 40, "--set", swap, "--bag", tmp_path / "bag", "--json")
    flown = formation_gnc(example, "sil", "leader_follower", *options)
    assert flown.returncode == 0, flown.stderr
    assert json.loads(flown.stdout)["misses"] == 0
    replayed = formation_gnc(example, "replay", tmp_path / "bag", "--bag", tmp_path / "again")
    assert replayed.returncode == 0, replayed.stderr
    compared = formation_gnc(example, "compare", tmp_path / "bag", tmp_path / "again")
    assert "identical on every GNC topic" in compared.stdout, compared.stdout + compared.stderr


@pytest.mark.thorough
def test_the_example_joins_the_reference_design_and_provenance(example):
    look = (
        "from tools.write_reference import parameters_page; from formation_gnc.recording.provenance import provenance;"
        "print(provenance()['versions']['own-law']); print(parameters_page())"
    )
    output = subprocess.run([sys.executable, "-c", look], env=example, capture_output=True, text=True, check=True)
    assert output.stdout.startswith("0.1.0\n")
    assert "| `pd.natural_frequency` | double | rad/s | `0.003` | above 0 | natural frequency | yes |" in output.stdout
    designed = formation_gnc(example, "design", "leader_follower", "--controller", "pd")
    assert "position gain [1/s^2]" in designed.stdout, designed.stderr


@pytest.mark.thorough
def test_the_example_passes_the_tests_of_every_law(example):
    command = [sys.executable, "-m", "pytest", "-q", "--disable-plugin-autoload", "-p", "hypothesispytest"]
    options = ["-c", str(EXAMPLE / "pyproject.toml"), "-p", "no:cacheprovider", str(EXAMPLE)]
    result = subprocess.run([*command, *options], env=example, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
    assert "8 passed" in result.stdout


@pytest.mark.thorough
@pytest.mark.parametrize("program", ["command", "node"])
def test_a_broken_plug_in_ends_a_process_in_one_line(program, tmp_path):
    (tmp_path / "broken_law.py").write_text("raise RuntimeError('out of order')\n")
    info = tmp_path / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[formation_gnc.laws]\nown = broken_law:Law\n")
    path = os.pathsep.join([str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": path}
    if program == "command":
        result = formation_gnc(environment, "sil", "leader_follower", "--in-process", "--duration", 2)
    else:
        pytest.importorskip("rclpy")
        node = (
            "import sys; sys.argv = ['formation_gnc/controller']; from formation_gnc.nodes.module import main; main()"
        )
        node = node.replace("main()", "sys.exit(main())")
        result = subprocess.run([sys.executable, "-c", node], env=environment, capture_output=True, text=True)
    assert result.returncode == 2
    (line,) = result.stderr.splitlines()
    assert "plug-in own (broken_law:Law of broken 1.0): cannot be imported: RuntimeError: out of order" in line
