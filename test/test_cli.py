"""The command line: output, rejections and exit status."""

import argparse
import json
import math
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from formation_gnc import __version__
from formation_gnc.cli import main
from formation_gnc.commands import COMMANDS
from formation_gnc.recording.reader import Bag
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import find_scenario
from formation_gnc.transport import launcher

DEFAULT = find_scenario("leader_follower").read_text()


@pytest.fixture(autouse=True)
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty working directory; restores the signal handlers."""
    monkeypatch.chdir(tmp_path)
    before = signal.getsignal(signal.SIGTERM)
    yield tmp_path
    signal.signal(signal.SIGTERM, before)


def call(*arguments: str) -> int:
    """Exit status of the command."""
    try:
        return main(arguments)
    except SystemExit as end:
        return int(end.code or 0)


def scenario(path: Path, nodes: str, line: str) -> None:
    """Write the default scenario with a parameter of some nodes changed."""
    path.write_text(f"{DEFAULT}\n{nodes}: {{ros__parameters: {{{line}}}}}\n")


def rejection(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line that rejects a call."""
    status = call(*arguments)
    output, errors = capsys.readouterr()
    assert (status, output) == (2, "")
    assert errors.count("\n") == 1
    assert errors.startswith("formation-gnc")
    assert errors.endswith("\n")
    return errors


BAD_OPTIONS = [
    (["--controller", "pid"], "parameter algorithm: 'pid' is not allowed; it must be one of coast, lqr"),
    (["--controller", ""], "parameter algorithm: '' is not allowed; it must be one of coast, lqr"),
    (["--duration", "nan"], "parameter duration: nan is not allowed; it must be finite"),
    (["--duration", "-5"], "parameter duration: -5.0 is not allowed; it must be above 0"),
    (["--duration", "0.2"], "parameter duration: 0.2 s is not allowed; it must be a tick or more"),
    (
        ["--duration", "1e300"],
        "parameter duration: 1e+300 is not allowed; it must be above 0, at most 2.14748e+09",
    ),
    (["--duration", "long"], "argument --duration: invalid float value: 'long'"),
    (["--orbits", "0"], "orbits: 0.0 is not allowed; it must be above 0 and finite"),
    (["--orbits", "inf"], "orbits: inf is not allowed; it must be above 0 and finite"),
    (["--orbits", "1e300"], "parameter duration: "),
    (["--orbits", "1", "--duration", "5"], "argument --duration: not allowed with argument --orbits"),
    (["--seed", "-1"], "parameter seed: -1 is not allowed; it must be at least 0"),
    (["--seed", "1.5"], "argument --seed: invalid int value: '1.5'"),
    (["--seed", str(2**63)], "parameter seed: 9223372036854775808 is not allowed; it must be within 64 bits"),
    (["--real-time-factor", "-2"], "parameter real_time_factor: -2.0 is not allowed; it must be at least 0"),
    (["--bag", "."], "bag .: exists already; name a directory that does not"),
    (["--fly"], "unrecognized arguments: --fly; see `formation-gnc --help`"),
]
BAD_PARAMETERS = [
    (
        "/**/plant",
        "deputy1.thrusters.limit: [.inf, 0.0, 0.0]",
        "/plant: parameter deputy1.thrusters.limit: inf is not allowed",
    ),
    ("/**/plant", "sede: 1", "/plant: parameter sede: unknown; did you mean seed?"),
    (
        "/**/plant",
        "deputy1.sensors.radius.interval: 2.5",
        "parameter deputy1.sensors.radius.interval: 2.5 s is not",
    ),
    (
        "/**/plant",
        "deputy1.relative_state: [-9e5, 0.0, 0.0, 0.0, 0.0, 0.0]",
        "must be at least the Earth's",
    ),
    ("/**/**", "chief.semi_major_axis: 6.0e+6", "perigee radius is 6000000.0 m: it must be at least"),
    (
        "/*/controller",
        "schedule: ['{at: soon}']",
        "parameter schedule: '{at: soon}' is not allowed; it must be like",
    ),
    (
        "/*/controller",
        "algorithm: [lqr]",
        "parameter algorithm: ['lqr'] is not allowed; it must be a value of type",
    ),
    (
        "/*/guidance",
        "formation: square",
        "parameter formation: 'square' is not allowed; it must be one of leader_",
    ),
    ("/*/navigation", "tick: [1.0", "bad.yaml: not YAML (while parsing a flow sequence"),
]


@pytest.mark.parametrize("way", [["--in-process"], []], ids=["in-process", "graph"])
class TestRejections:
    """An input that is not allowed is rejected before anything is started or written."""

    @pytest.fixture(autouse=True)
    def nothing_starts(self, desk: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        def start(*_: Any) -> None:
            raise AssertionError("a node was started")

        monkeypatch.setattr(launcher.Graph, "start", start)
        before = sorted(desk.rglob("*"))
        yield
        assert [path for path in sorted(desk.rglob("*")) if path not in before and path.name != "bad.yaml"] == []

    @pytest.mark.parametrize(("options", "words"), BAD_OPTIONS)
    def test_an_option_that_is_not_allowed_is_named(
        self, options: list[str], words: str, way: list[str], capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert words in rejection(capsys, "sil", "leader_follower", *options, *way)

    @pytest.mark.parametrize(("nodes", "line", "words"), BAD_PARAMETERS)
    def test_a_parameter_that_is_not_allowed_is_named(
        self,
        nodes: str,
        line: str,
        words: str,
        way: list[str],
        desk: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        scenario(desk / "bad.yaml", nodes, line)
        assert words in rejection(capsys, "sil", "bad.yaml", *way)

    @pytest.mark.parametrize(
        ("scenario", "words"),
        [
            ("nowhere", "scenario nowhere: unknown; it must be a parameter file or one of bad_day"),
            ("nowhere.yaml", "scenario nowhere.yaml: no such file"),
            ("/proc/self/mem", "/proc/self/mem: cannot be read (Input/output error)"),
        ],
    )
    def test_a_missing_scenario_is_named(
        self, scenario: str, words: str, way: list[str], capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert words in rejection(capsys, "sil", scenario, *way)


def test_a_real_time_factor_is_rejected_in_process(capsys: pytest.CaptureFixture[str]) -> None:
    printed = rejection(capsys, "sil", "leader_follower", "--in-process", "--real-time-factor", "5")
    assert "real_time_factor: has no effect in-process" in printed


@pytest.mark.parametrize(("arguments", "words"), [([], "required: COMMAND"), (["fly"], "invalid choice: 'fly'")])
def test_an_unknown_command_is_rejected_with_a_hint(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = rejection(capsys, *arguments)
    assert words in printed
    assert printed.endswith("see `formation-gnc --help`\n")


@pytest.mark.thorough
def test_the_installed_command_rejects_in_one_line(desk: Path) -> None:
    ended = subprocess.run(
        ["formation-gnc", "sil", "nowhere"],
        cwd=desk,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("formation-gnc: scenario nowhere: unknown; ")
    assert ended.stderr.count("\n") == 1


@pytest.mark.thorough
def test_json_is_one_object_with_stable_names(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--duration", "30.5", "--seed", "5", "--bag", "flights/first", "--json", "--in-process"]
    assert call("sil", "leader_follower", *options) == 0
    summary = json.loads(capsys.readouterr().out)
    assert set(summary) >= {"scenario", "seed", "ticks", "misses", "speedup", "bag", "deputies"}
    assert (summary["scenario"], summary["seed"]) == ("leader_follower", 5)
    assert (summary["ticks"], summary["misses"]) == (31, 0)  # the last tick begins within the duration
    assert summary["speedup"] > 0.0
    assert Path(summary["bag"]) == Path("flights/first")
    assert list(summary["deputies"]) == ["deputy1"]
    figures = summary["deputies"]["deputy1"]
    assert set(figures) >= {"final_error_m", "rms_error_m", "estimate_rms_m", "mean_nis", "delta_v_m_s"}
    assert all(math.isfinite(value) for value in figures.values() if isinstance(value, float))
    # 10 m off in every axis, and half a minute at 1e-4 m/s^2 does not change that by 0.1 m
    assert figures["final_error_m"] == pytest.approx(10.0 * math.sqrt(3.0), abs=0.1)
    bag = Bag(desk / "flights/first")
    assert bag.topics["/truth"].count == 31


@pytest.mark.thorough
def test_the_summary_names_the_figures_the_bag_and_the_picture(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("sil", "leader_follower", "--controller", "coast", "--duration", "12", "--in-process") == 0
    printed = capsys.readouterr().out
    for words in (
        "final position error",
        "RMS position error",
        "RMS estimation error",
        "NIS over expected",
        "formation held",
        "delta-v",
    ):
        assert words in printed
    assert "12 ticks, 0 missed" in printed
    (bag,) = (desk / "bags").iterdir()
    assert f"bag: bags/{bag.name}\n" in printed
    assert f"picture: bags/{bag.name}/overview.png\n" in printed
    assert (bag / "overview.png").read_bytes().startswith(b"\x89PNG")
    assert bag.name.startswith("leader_follower_")


def test_an_interrupt_closes_the_bag(
    desk: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    fly = Run.tick

    def tick(run: Run, sink: Any) -> None:
        if run.plant.tick == 20:
            raise KeyboardInterrupt
        fly(run, sink)

    monkeypatch.setattr(Run, "tick", tick)
    assert call("sil", "leader_follower", "--bag", "cut", "--in-process") == 130
    assert capsys.readouterr().err == "formation-gnc: interrupted; bag closed: cut\n"
    assert Bag(desk / "cut").topics["/truth"].count == 20


@pytest.mark.thorough
def test_a_reentry_ends_the_run_and_closes_the_bag(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario(
        desk / "falling.yaml",
        "/**/plant",
        "deputy1.relative_state: [0, -90, 0, 0, -160, 0], forces.drag: true",
    )
    assert call("sil", "falling.yaml", "--bag", "down", "--in-process") == 1
    printed = capsys.readouterr().err
    assert "below the Earth's surface" in printed
    assert printed.endswith("bag closed: down\n")
    # half an orbit down to a perigee in the thickest air
    assert 2000 < Bag(desk / "down").topics["/truth"].count < 2900


def test_help_names_every_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call("--help") == 0
    printed = capsys.readouterr().out
    assert "Fly satellites in formation" in printed
    for name in COMMANDS:
        assert f"\n    {name} " in printed


def test_help_imports_no_library_of_numbers() -> None:
    """It takes a fifth of a second, and took five."""
    code = "import sys\ntry:\n from formation_gnc.cli import main; main(['--help'])\nfinally:\n print(*sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"numpy", "scipy", "numba", "rich", "yaml", "rclpy"} & set(shown.splitlines()[-1].split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_describes_all_its_options(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(name, "--help") == 0
    printed = capsys.readouterr().out
    assert printed.startswith(f"usage: formation-gnc {name}")
    command = import_module(f"formation_gnc.commands.{name}")
    assert (command.__doc__ or "").strip() in printed
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    for action in parser._actions:
        assert action.help, f"{action.dest} has no help"
        assert max(action.option_strings or [str(action.metavar or action.dest)], key=len) in printed


@pytest.mark.thorough
@pytest.mark.parametrize("entry", ["commands.sil", "nodes.module", "nodes.plant", "nodes.recorder"])
def test_a_flight_imports_no_heavy_library_in_vain(entry: str) -> None:
    """Plots, tables, distributions and databases take seconds to import, times the nodes of a fleet."""
    heavy = {
        "matplotlib",
        "plotly",
        "pandas",
        "pyarrow",
        "scipy.stats",
        "rosbags.rosbag2",
        "apsw",
        "control",
        "skyfield",
    }
    asked = f"import sys, formation_gnc.{entry}; print(*{heavy} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert found.stdout.split() == []


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--version") == 0
    assert capsys.readouterr().out == f"formation-gnc {__version__}\n"
