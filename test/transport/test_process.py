"""The end of a node's process, whatever the middleware does."""

import subprocess
import sys

import pytest

ENDING = """
import ctypes
from formation_gnc.transport import process

class Node:
    def spin(self):
        pass

    def destroy_node(self):
        {destroy}

process.LONGEST_END, process.HUNG = 0.2, 5.0
process.run(Node)
"""


@pytest.mark.parametrize(
    ("destroy", "status"),
    [
        ("pass", 0),
        ("import time; time.sleep(1000)", 0),
        ("ctypes.PyDLL(None).sleep(1000)", 1),  # holds the interpreter: no other thread of it runs
    ],
)
def test_a_process_ends_though_its_node_does_not_leave_the_graph(destroy: str, status: int) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", ENDING.format(destroy=destroy)], capture_output=True, text=True, timeout=100.0
    )
    assert ended.returncode == status, ended.stderr
    assert ("in destroy_node" in ended.stderr) == (status == 1), "says where it hung"
