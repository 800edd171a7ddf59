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

FLIGHT = "sil leader_follower --in-process --duration 40 --bag without --json"
REFUSED = {
    "sil leader_follower": "--in-process flies without",
    "set deputy1/controller algorithm=mpc": "lacks rclpy, ",
    "view": "--bag shows a recorded run without",
}
"""Commands that need the node graph, and words of what they say."""

SCRIPT = f"""
import importlib, pkgutil
import formation_gnc
from formation_gnc.cli import main

for module in pkgutil.walk_packages(formation_gnc.__path__, "formation_gnc."):
    if module.name.split(".")[1] not in ("transport", "nodes", "share"):
        importlib.import_module(module.name)
print([main(each.split()) for each in {list(REFUSED)}])
print(main({FLIGHT.split()}), main("replay without --bag again".split()))
"""


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of a process without ROS that imported all modules and ran the commands; its output is in files."""
    directory = tmp_path_factory.mktemp("desk")
    variables = {name: value for name, value in os.environ.items() if name != "AMENT_PREFIX_PATH"}
    command = [sys.executable, "-c", f"{WITHOUT}\n{SCRIPT}"]
    with (directory / "out").open("w") as out, (directory / "err").open("w") as err:
        environment = variables | {"PYTHONPATH": str(ROOT)}
        done = subprocess.run(command, cwd=directory, env=environment, stdout=out, stderr=err, timeout=300)
    assert done.returncode == 0, (directory / "err").read_text()
    return directory


@pytest.mark.thorough
def test_what_needs_the_graph_says_in_a_line_what_is_missing(desk: Path) -> None:
    assert (desk / "out").read_text().startswith("[2, 2, 2]\n")
    for line, words in zip((desk / "err").read_text().splitlines(), REFUSED.values(), strict=True):
        assert "formation-gnc: the node graph needs ROS 2 Jazzy" in line
        assert "formation_gnc_msgs" in line
        assert words in line


@pytest.mark.thorough
def test_a_flight_has_the_bits_and_definitions_of_one_with_ros(desk: Path, tmp_path: Path) -> None:
    output = (desk / "out").read_text()
    assert "identical on every GNC topic" in output
    assert output.endswith("\n0 0\n")
    one = Bag(desk / "without")
    other = fly(load_scenario("leader_follower", {"/plant": {"duration": 40.0}}), tmp_path / "with")
    assert one.topics.keys() == other.topics.keys()
    for topic in one.topics:
        assert list(one.messages([topic])) == list(other.messages([topic]))
        (mine, channel), (theirs, others) = one.definition(topic), other.definition(topic)
        assert mine is not None
        assert theirs is not None
        assert (mine.data, channel.metadata) == (theirs.data, others.metadata)
