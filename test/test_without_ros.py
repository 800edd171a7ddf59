"""Everything but the ROS shell works where ROS cannot be imported."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from formation_gnc.commands.ros import PACKAGES
from formation_gnc.recording import Bag
from formation_gnc.sil.recorded_flight import fly
from formation_gnc.sil.scenario import load_scenario

ROOT = Path(__file__).resolve().parents[1]

OF_ROS = (*PACKAGES, "ament_index_python", "launch", "rosidl_parser", "rosidl_runtime_py", "rpyutils", "tf2_msgs")
WITHOUT = f"import sys; sys.modules.update(dict.fromkeys({OF_ROS!r}))"  # None: there is no such module

IMPORT_ALL = """
import importlib, pkgutil
import formation_gnc
for module in pkgutil.walk_packages(formation_gnc.__path__, "formation_gnc."):
    if module.name.split(".")[1] not in ("transport", "nodes", "share"):
        importlib.import_module(module.name)
print(len(sys.modules))
"""


def python(code: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run code in a process that has no ROS."""
    variables = {name: value for name, value in os.environ.items() if name != "AMENT_PREFIX_PATH"}
    environment = variables | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", f"{WITHOUT}\n{code}"]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300)


def test_the_core_and_every_command_import(tmp_path: Path) -> None:
    result = python(IMPORT_ALL, tmp_path)
    assert result.returncode == 0, result.stderr


@pytest.mark.thorough
def test_a_flight_has_the_bits_and_definitions_of_one_with_ros(tmp_path: Path) -> None:
    flight = ["sil", "leader_follower", "--in-process", "--duration", "40", "--bag", "without"]
    replay = ["replay", "without", "--bag", "again"]
    code = f"from formation_gnc.cli import main; sys.exit(main({flight}) or main({replay}))"
    flown = python(code, tmp_path)
    assert flown.returncode == 0, flown.stderr
    assert "identical on every GNC topic" in flown.stdout
    one = Bag(tmp_path / "without")
    other = fly(load_scenario("leader_follower", {"/plant": {"duration": 40.0}}), tmp_path / "with")
    assert one.topics.keys() == other.topics.keys()
    for topic in one.topics:
        assert list(one.messages([topic])) == list(other.messages([topic]))
        (mine, channel), (theirs, others) = one.definition(topic), other.definition(topic)
        assert mine is not None
        assert theirs is not None
        assert (mine.data, channel.metadata) == (theirs.data, others.metadata)


def test_what_needs_the_graph_says_in_a_line_what_is_missing(tmp_path: Path) -> None:
    commands = {
        "sil leader_follower": "--in-process flies without",
        "set deputy1/controller algorithm=mpc": "lacks rclpy, ",
        "view": "--bag shows a recorded run without",
    }
    asked = [each.split() for each in commands]
    result = python(f"from formation_gnc.cli import main; print([main(each) for each in {asked}])", tmp_path)
    assert result.stdout == "[2, 2, 2]\n"
    for line, words in zip(result.stderr.splitlines(), commands.values(), strict=True):
        assert "formation-gnc: the node graph needs ROS 2 Jazzy" in line
        assert "formation_gnc_msgs" in line
        assert words in line
    assert list(tmp_path.iterdir()) == []
