"""The real `ros2` on our nodes, where it is installed; test_parameter_protocol sends what it sends where it is not."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from formation_gnc.transport.node import ConfiguredNode

from .conftest import MAKERS, Bench

pytestmark = [
    pytest.mark.sil,
    pytest.mark.skipif(shutil.which("ros2") is None, reason="no ros2 command on PATH"),
]

SPIN = 10.0  # s that `ros2` looks for nodes, without its daemon


def ros2(bench: Bench, node: ConfiguredNode, *arguments: str) -> str:
    """What a command prints while a node is served."""
    environment = os.environ | {"ROS_DOMAIN_ID": str(bench.user.context.get_domain_id())}
    command = ["ros2", *arguments, "--no-daemon", "--spin-time", str(SPIN)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        bench.spin(node, until=lambda: process.poll() is not None, rounds=30000)
        assert process.stdout is not None
        assert process.stderr is not None
        output, errors = process.stdout.read().decode(), process.stderr.read().decode()
    assert process.returncode == 0, errors
    return output


@pytest.mark.parametrize("name", MAKERS)
def test_a_dump_of_a_node_is_loaded_and_starts_it_again(bench: Bench, tmp_path: Path, name: str) -> None:
    node = bench.make(name)
    full_name = node.get_fully_qualified_name()
    file = tmp_path / "dump.yaml"
    file.write_text(ros2(bench, node, "param", "dump", full_name))
    loaded = ros2(bench, node, "param", "load", full_name, str(file))
    assert [line for line in loaded.splitlines() if line.strip() and not line.endswith(" successful")] == []
    if name != "recorder":  # its bag is there already
        assert bench.make(name, files=(file,)).values == node.values
