"""The packages as colcon sees them, the environment as a user gets it, and what a lacking machine is told."""

import ast
import importlib
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

import formation_gnc
from formation_gnc import records
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.access import access_by_process
from formation_gnc.messages.conversion import type_name
from formation_gnc.parameters import read_yaml
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport import security
from formation_gnc.transport.keystore import make_keystore

ROOT = Path(__file__).resolve().parents[1]
NODES = {"plant", "navigation", "guidance", "controller", "supervisor", "recorder"}

needs_set_up = pytest.mark.skipif(not (ROOT / "install/.ready").exists(), reason="needs `make setup`")


def run(*command: str, cwd: Path = ROOT, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command as in a fresh shell, with `variables` on top of the least environment."""
    environment = {"PATH": os.environ["PATH"], "HOME": os.environ["HOME"], **variables}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300)


def colcon_list(cwd: Path, *arguments: str) -> dict[str, str]:
    """Return the build type of every package that colcon finds, by name."""
    listing = run(sys.executable, "-m", "colcon", "list", *arguments, cwd=cwd)
    assert listing.returncode == 0, listing.stderr
    rows = (line.split("\t") for line in listing.stdout.splitlines())
    return {name: kind.strip("()") for name, _, kind in rows}


def imports(file: Path) -> Iterator[str]:
    """Yield the module that each import statement in a Python file names."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def workspace(folder: Path) -> Path:
    """Lay out a ROS workspace, as the README says, with a copy of what is under version control."""
    listing = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True)
    clone = folder / "src/formation_gnc"
    for name in filter(lambda name: (ROOT / name).is_file(), listing.stdout.splitlines()):
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, clone / name)
    (folder / "src/formation_gnc_msgs").symlink_to("formation_gnc/msg_defs")
    return folder


def without(folder: Path, *tools: str) -> str:
    """Make a `bin` in which the tools that the set-up calls are found, but not these; return it as PATH."""
    (folder / "bin").mkdir()
    for tool in {"bash", "dirname", "cc", "c++"} - set(tools):
        (folder / "bin" / tool).symlink_to(shutil.which(tool) or f"/usr/bin/{tool}")
    return str(folder / "bin")


def test_colcon_takes_both_for_ros_packages_from_the_repository_root():
    # An invalid package.xml is no error to colcon: it falls back to plain `python` and `cmake` and
    # loses the order in which to build.
    assert colcon_list(ROOT) == {"formation_gnc": "ros.ament_python", "formation_gnc_msgs": "ros.ament_cmake"}


@pytest.mark.thorough
def test_colcon_takes_both_for_ros_packages_in_a_workspace(tmp_path):
    assert colcon_list(workspace(tmp_path)) == {
        "formation_gnc": "ros.ament_python",
        "formation_gnc_msgs": "ros.ament_cmake",
    }


def test_versions_agree():
    stated = {
        "package.xml": "<version>{}</version>",
        "msg_defs/package.xml": "<version>{}</version>",
        "setup.py": 'version="{}"',
    }
    for name, statement in stated.items():
        assert statement.format(formation_gnc.__version__) in (ROOT / name).read_text(), name


IN_DISTRIBUTIONS = {"cryptography", "matplotlib", "numba", "numpy", "rich", "scipy", "yaml"}
"""Modules of packages that rosdep installs from a distribution (rosdistro, rosdep/python.yaml)."""

BY_PIP = {
    *("clarabel", "control", "filterpy", "lz4", "mcap", "osqp", "plotly", "pymsis", "rosbags", "setproctitle"),
    *("skyfield", "zstandard"),
}
"""Those that it does not."""


@needs_set_up
@pytest.mark.thorough
def test_package_xml_declares_the_ros_packages_in_use():
    files = [*ROOT.glob("formation_gnc/**/*.py"), *ROOT.glob("launch/*.py")]
    imported = {name.split(".")[0] for file in files for name in imports(file)}
    mirrored = [each for each in vars(records).values() if isinstance(each, type) and hasattr(each, "message")]
    imported |= {type_name(record).partition("/")[0] for record in mirrored}  # loaded by name
    declared = {element.text for element in ElementTree.parse(ROOT / "package.xml").iter("exec_depend")}
    query = "import ament_index_python as index; print(*index.get_packages_with_prefixes())"
    listing = run("bash", "-c", f"source {ROOT}/env.sh && python -c '{query}'")
    there = {*listing.stdout.split(), "launch", "launch_ros", "tf2_msgs"}  # the wheels leave these out
    keys = {f"python3-{name}" for name in imported & IN_DISTRIBUTIONS}
    assert declared == imported & there - {"formation_gnc"} | keys
    stated = (ROOT / "package.xml").read_text()
    assert [name for name in imported & BY_PIP if name.replace("_", "-") not in stated] == []


@needs_set_up
@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_environment_from_any_directory(shell, tmp_path):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    script = f"""
        cd {tmp_path} && source {ROOT}/env.sh || exit
        command -v formation-gnc
        python -c 'import rclpy, formation_gnc, formation_gnc_msgs.msg; print(formation_gnc.__file__)'
        echo $ROS_AUTOMATIC_DISCOVERY_RANGE $RMW_IMPLEMENTATION $OMP_NUM_THREADS
        command -v plant recorder || echo no node on PATH
    """
    result = run(shell, "-c", script)
    assert result.stderr == ""
    command, package, settings, nodes = result.stdout.splitlines()
    assert command == f"{ROOT}/install/formation_gnc/bin/formation-gnc"
    # The sources themselves, or links to them: a change of a Python file needs no build.
    assert Path(package).resolve() == ROOT / "formation_gnc/__init__.py"
    assert settings == "LOCALHOST rmw_fastrtps_cpp 1"
    assert nodes == "no node on PATH"


@needs_set_up
def test_environment_leaves_the_users_settings_alone():
    script = f"set -eu; source {ROOT}/env.sh; echo $ROS_AUTOMATIC_DISCOVERY_RANGE $OMP_NUM_THREADS; echo $-"
    result = run("bash", "-c", script, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET", OMP_NUM_THREADS="2")
    settings, options = result.stdout.splitlines()
    assert settings == "SUBNET 2"
    assert set("eu") <= set(options)


@needs_set_up
def test_environment_names_a_middleware_that_is_not_there():
    script = f"source {ROOT}/env.sh; echo status $?"
    result = run("bash", "-c", script, RMW_IMPLEMENTATION="rmw_unheard_of_cpp")
    assert result.stdout == "status 1\n"
    assert result.stderr.count("\n") == 1
    assert "rmw_unheard_of_cpp is not installed" in result.stderr


def test_environment_before_the_build_says_what_to_run_and_keeps_the_shell(tmp_path):
    shutil.copy(ROOT / "env.sh", tmp_path)
    result = run("bash", "-c", f"source {tmp_path}/env.sh; echo still here")
    assert result.stdout == "still here\n"
    assert result.stderr.count("\n") == 1
    assert "make setup" in result.stderr


@needs_set_up
def test_every_node_is_where_ros2_run_looks_and_runs_in_our_python():
    executables = ROOT / "install/formation_gnc/lib/formation_gnc"
    assert {path.name for path in executables.iterdir()} >= NODES
    for node in NODES:
        assert os.access(executables / node, os.X_OK)
        assert (executables / node).read_text().startswith(f"#!{ROOT}/.venv/bin/python")


def test_another_ros_is_rejected_in_one_line():
    result = run("tools/find_ros.sh", ROS_DISTRO="humble")
    assert (result.returncode, result.stdout) == (2, "")
    assert re.fullmatch(r"formation_gnc: .*Jazzy.*humble.*\n", result.stderr)


def test_a_sourced_jazzy_is_used_but_a_venv_of_wheels_is_not(tmp_path):
    for prefix in ("jazzy", "wheels"):
        (tmp_path / prefix / "share/rclpy").mkdir(parents=True)
    (tmp_path / "wheels/pyvenv.cfg").touch()
    prefixes = f"{tmp_path}/overlay:{tmp_path}/wheels:{tmp_path}/jazzy"
    result = run("tools/find_ros.sh", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=prefixes)
    assert result.stdout == f"{tmp_path}/jazzy\n"
    if not Path("/opt/ros/jazzy").exists():
        result = run("tools/find_ros.sh", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=f"{tmp_path}/wheels")
        assert result.stdout == "wheels\n"


@pytest.mark.parametrize(("lacking", "advice"), [("c++", "install g++"), ("python3.12", "install python3.12")])
def test_a_machine_without_is_told_in_one_line_what_to_install(lacking, advice, tmp_path):
    shutil.copytree(ROOT / "tools", tmp_path / "tools")
    (tmp_path / ".ros").write_text(f"wheels for {tmp_path}\n")
    result = run("tools/make_venv.sh", cwd=tmp_path, PATH=without(tmp_path, lacking), PYENV_ROOT=str(tmp_path))
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1
    assert advice in result.stderr
    assert not (tmp_path / ".venv").exists()


def test_uv_fetches_the_python_that_a_machine_lacks(tmp_path):
    """With an uv and a Python that only say what they were asked for; the set-up ends where that makes no .venv."""
    shutil.copytree(ROOT / "tools", tmp_path / "tools")
    (tmp_path / ".ros").write_text(f"wheels for {tmp_path}\n")
    path = without(tmp_path, "python3.12")
    shutil.copy(shutil.which("rm"), tmp_path / "bin/rm")
    shutil.copy(shutil.which("cmp"), tmp_path / "bin/cmp")
    for name, script in {
        "uv": f'echo "$*" >> {tmp_path}/asked; [ "$2" = install ] || echo {tmp_path}/python',
        "../python": f'echo "$*" >> {tmp_path}/asked; exit 7',
    }.items():
        (tmp_path / "bin" / name).write_text(f"#!/usr/bin/env bash\n{script}\n")
        (tmp_path / "bin" / name).chmod(0o755)
    result = run("tools/make_venv.sh", cwd=tmp_path, PATH=path, PYENV_ROOT=str(tmp_path), XDG_DATA_HOME=str(tmp_path))
    assert result.returncode == 7, result.stderr
    first, second = result.stdout.splitlines()
    assert first.endswith("uv fetches one, for this user")
    assert f"making .venv with {tmp_path}/python" in second
    asked = (tmp_path / "asked").read_text().splitlines()
    assert asked[-3:] == ["python install --quiet 3.12", "python find 3.12", "-m venv .venv"]


def test_all_that_a_machine_lacks_is_told_at_once(tmp_path):
    shutil.copytree(ROOT / "tools", tmp_path / "tools")
    (tmp_path / ".ros").write_text(f"wheels for {tmp_path}\n")
    nothing = {
        "PATH": without(tmp_path, "c++", "python3.12"),
        "PYENV_ROOT": str(tmp_path),
        "XDG_DATA_HOME": str(tmp_path),
    }
    result = run("tools/make_venv.sh", cwd=tmp_path, **nothing)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    for advice in ("install g++", "install python3.12", "by which uv fetches one"):
        assert advice in result.stderr


def test_the_lock_pins_every_package_with_its_hashes():
    for name in ("requirements.lock", "requirements-verify.lock"):
        entries = re.split(r"\n(?=[a-z0-9])", (ROOT / name).read_text().split("\n", 2)[2])
        assert len(entries) > 10
        for entry in entries:
            assert re.match(r"[a-z0-9-]+==\S+ \\\n    --hash=sha256:[0-9a-f]{64}", entry), entry.split("\n")[0]


def test_image_devcontainer_and_ci_set_up_as_the_documentation_says():
    image = (ROOT / "Dockerfile").read_text()
    packages = "python3.12 python3.12-dev python3.12-venv g++ make git"
    assert packages in image
    assert packages in (ROOT / "docs/installation.md").read_text()
    container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text())
    place = ROOT / ".devcontainer" / container["build"]["dockerfile"]
    assert place.resolve() == ROOT / "Dockerfile"
    assert f"WORKDIR {container['workspaceFolder']}\n" in image
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
    commands = {name: [step.get("run") for step in job["steps"]] for name, job in jobs.items()}
    assert ".ci/run" in commands["wheels"]
    assert ".ci/run" in commands["jazzy"]
    assert jobs["jazzy"]["container"] == "ros:jazzy-ros-base"


def test_pre_commit_runs_the_checks_of_make_check():
    (checks,) = re.findall(r"^check:.*\n\t@\$\(in_environment\) (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local", "nothing is fetched"
    hooks = [re.sub(r"^\.venv/bin/| --force-exclude", "", hook["entry"]) for hook in repository["hooks"]]
    assert hooks == [check.removesuffix(" .") for check in checks.split(" && ")]
    assert {hook["language"] for hook in repository["hooks"]} == {"system"}


def test_versions_and_authors_of_the_citation_are_those_of_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == formation_gnc.__version__
    assert [each["name"] for each in citation["authors"]] == ["formation_gnc maintainers"]
    assert f"\n## {formation_gnc.__version__} - " in (ROOT / "CHANGELOG.md").read_text()


def test_both_locks_pin_the_same_version_of_what_they_share():
    one, other = (
        dict(re.findall(r"^([a-z0-9-]+)==(\S+)", (ROOT / name).read_text(), re.MULTILINE))
        for name in ("requirements.lock", "requirements-verify.lock")
    )
    shared = one.keys() & other.keys()
    assert {name: one[name] for name in shared} == {name: other[name] for name in shared}


LAUNCH_FILE = ROOT / "launch/sil.launch.py"


def started(context: Any, **arguments: str) -> list[Any]:
    """Run the launch file with arguments, as `ros2 launch` would, up to the nodes that it would start."""
    description = runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]()
    *declared, function = description.entities
    for each in declared:
        each.visit(context)
    context.launch_configurations.update(arguments)
    return function.execute(context)


def test_the_launch_file_starts_every_node():
    pytest.importorskip("launch_ros", reason="launch comes with an installed ROS only")
    nodes = started(importlib.import_module("launch").LaunchContext())
    assert {node.node_executable for node in nodes} == NODES


@pytest.fixture
def launch_double(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """A stand-in for the launch packages, with as much of them as the launch file uses; gives the context."""

    class Declared(SimpleNamespace):
        def visit(self, context: SimpleNamespace) -> None:
            assert self.default_value in self.__dict__.get("choices", [self.default_value])
            context.launch_configurations.setdefault(self.name, self.default_value)

    class Function(SimpleNamespace):
        def execute(self, context: SimpleNamespace) -> list[Any]:
            return self.function(context)

    def configuration(name: str) -> SimpleNamespace:
        return SimpleNamespace(perform=lambda context: context.launch_configurations[name])

    doubles = {
        "launch": {
            "LaunchContext": SimpleNamespace,
            "LaunchDescription": lambda entities: SimpleNamespace(entities=entities),
        },
        "launch.actions": {
            "DeclareLaunchArgument": lambda name, **options: Declared(name=name, **options),
            "OpaqueFunction": Function,
            "EmitEvent": SimpleNamespace,
        },
        "launch.events": {},
        "launch.events.process": {"ShutdownProcess": SimpleNamespace},
        "launch.logging": {"launch_config": SimpleNamespace(log_dir=str(tmp_path))},
        "launch.substitutions": {"LaunchConfiguration": configuration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": SimpleNamespace},
        "ament_index_python": {},
        "ament_index_python.packages": {"get_package_share_directory": lambda _: ROOT},
    }
    for name, contents in doubles.items():
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(**contents))
    return SimpleNamespace(launch_configurations={})


@pytest.mark.parametrize("composed", ["false", "true"])
@pytest.mark.parametrize("scenario", sorted(path.stem for path in (ROOT / "params").glob("*.yaml")))
def test_the_launch_file_starts_all_deputies_of_any_scenario(launch_double, scenario, composed):
    nodes = started(launch_double, scenario=scenario, use_composition=composed)
    deputies = load_scenario(scenario).plant.deputies
    parts = {"satellite"} if composed == "true" else {"navigation", "guidance", "controller", "supervisor"}
    assert {(node.namespace, node.executable) for node in nodes} == {
        ("", "plant"),
        ("", "recorder"),
        *product(deputies, parts),
    }
    assert len(nodes) == 2 + len(deputies) * len(parts)
    assert {path for node in nodes for path in node.parameters} == {str(ROOT / f"params/{scenario}.yaml")}
    assert [node.executable for node in nodes if hasattr(node, "on_exit")] == ["plant"]


def test_launch_file_takes_a_path_and_defaults_to_leader_follower(launch_double, tmp_path):
    assert {node.executable for node in started(launch_double)} == NODES
    path = tmp_path / "own.yaml"
    path.write_text("/plant: {ros__parameters: {duration: 9.0}}\n")
    nodes = started(launch_double, scenario=str(path))
    assert {node.namespace for node in nodes} == {"", "deputy1"}
    assert nodes[0].parameters == [str(path)]


def test_the_launch_file_flies_what_a_scenario_extends(launch_double, tmp_path):
    """ROS reads no file with `extends`: its nodes get one with all that results."""
    own = tmp_path / "own" / "pair.yaml"
    own.parent.mkdir()
    own.write_text("extends: tetrahedral\n/plant: {ros__parameters: {duration: 90.0}}\n")
    nodes = started(launch_double, scenario=str(own))
    (file,) = {path for node in nodes for path in node.parameters}
    assert Path(file).name == own.name
    assert {node.namespace for node in nodes} == {"", *load_scenario("tetrahedral").plant.deputies}
    assert "extends" not in read_yaml(Path(file).read_text())
    assert load_scenario(file) == load_scenario(str(own))


def test_the_end_of_a_flight_ends_its_own_nodes_alone(launch_double):
    """Another formation of the same launch flies on."""
    one, two = (started(launch_double, namespace=name, display="true") for name in ("one", "two"))
    ends = one[0].on_exit.event.process_matcher
    assert [node.executable for node in one if not ends(node)] == []
    assert [node.namespace for node in two if ends(node)] == []


def test_launch_arguments_reach_the_nodes_that_they_are_for(launch_double):
    given = {"seed": "7", "duration": "90", "controller": "mpc", "bag": "bags/x", "use_sim_time": "true"}
    nodes = started(launch_double, namespace="alpha", display="true", use_respawn="true", log_level="warn", **given)
    words = {node.executable: " ".join(node.ros_arguments) for node in nodes}
    assert set(words) == NODES | {"display"}
    for each in words.values():
        assert "--log-level warn -p use_sim_time:=true" in each
    assert words["plant"].endswith("-p wait_for_recorder:=true -p seed:=7 -p duration:=90.0")
    assert words["recorder"].endswith("-p bag:=bags/x")
    assert words["controller"].endswith("-p controller:algorithm:=mpc")
    assert [name for name, each in words.items() if "mpc" in each] == ["controller"]
    assert {node.namespace for node in nodes} == {"alpha", "alpha/deputy1"}
    assert {node.executable for node in nodes if getattr(node, "respawn", False)} == NODES - {"plant", "recorder"}


@pytest.mark.parametrize("namespace", ["", "alpha"])
def test_launch_file_flies_every_node_in_its_enclave_or_none(launch_double, namespace, tmp_path, monkeypatch):
    formation = f"/{namespace}" if namespace else ""
    keystore = tmp_path / "keys"
    make_keystore(keystore, access_by_process(["deputy1"], formation))
    tried = []
    monkeypatch.setattr(security.subprocess, "run", lambda command, **_: tried.append(command) or done)
    done = subprocess.CompletedProcess([], 0)
    nodes = started(launch_double, namespace=namespace, keystore=str(keystore), display="true")
    assert {node.executable for node in nodes} == NODES | {"display"}
    assert len(tried) == 1
    for node in nodes:
        place = "/".join(("", *filter(None, (node.namespace, node.executable))))
        assert node.ros_arguments[:2] == ["--enclave", place]
        assert node.additional_env == security.variables(keystore)
    done = subprocess.CompletedProcess([], 2, "no security libraries")
    with pytest.raises(ConfigurationError, match="nothing flies"):
        started(launch_double, namespace=namespace, keystore=str(keystore))
    shutil.rmtree(keystore / f"enclaves{formation}/deputy1/satellite")
    with pytest.raises(ConfigurationError, match=f"enclave {formation}/deputy1/satellite lacks"):
        started(launch_double, namespace=namespace, keystore=str(keystore), use_composition="true")


def test_launch_file_leaves_security_to_the_environment_without_a_keystore(launch_double):
    assert [node.additional_env for node in started(launch_double)] == [{}] * len(NODES)


@needs_set_up
@pytest.mark.slow  # builds both packages from nothing: about half a minute
def test_a_plain_build_in_a_workspace_stands_alone(tmp_path):
    folder = workspace(tmp_path)
    build = run("bash", "-c", f"source {ROOT}/.venv/setup.bash && colcon build", cwd=folder)
    assert build.returncode == 0, build.stderr
    imports = "import formation_gnc, formation_gnc_msgs.msg; print(formation_gnc.__file__)"
    result = run("bash", "-c", f"source {folder}/install/setup.bash && python3 -c '{imports}'", cwd=tmp_path)
    assert Path(result.stdout.strip()).is_relative_to(folder / "install"), result.stderr
    share = folder / "install/formation_gnc/share/formation_gnc"
    assert {path.name for path in (ROOT / "params").glob("*.yaml")} == {p.name for p in (share / "params").iterdir()}
