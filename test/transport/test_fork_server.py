"""Processes that are forks: as `ros2 run` starts them, and ended with whoever started them."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from formation_gnc.sil.scenario import find_scenario
from formation_gnc.transport.fork_server import ForkedProcess, ForkServer
from formation_gnc.transport.processes import executable

pytestmark = pytest.mark.sil  # it starts processes


def wait_until(condition: Callable[[], object], what: str) -> None:
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def start(server: ForkServer, log: Path, *arguments: str, **environment: str) -> ForkedProcess:
    """A navigation node in a domain of the test's own; by default it flies until it is told not to."""
    domain = {"ROS_DOMAIN_ID": "0", "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
    return server.start(
        executable("navigation"),
        ["--ros-args", "-r", "__ns:=/deputy1", "--params-file", str(find_scenario("leader_follower")), *arguments],
        dict(os.environ) | domain | environment,
        log,
    )


def is_there(pid: int) -> bool:
    """Whether a process lives; one that has ended and waits to be noticed does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.fixture(scope="module")
def server() -> ForkServer:
    return ForkServer()


def test_a_node_is_a_process_in_a_group_of_its_own_and_shown_as_one(server: ForkServer, tmp_path: Path) -> None:
    process = start(server, tmp_path / "log")
    shown = Path(f"/proc/{process.pid}/cmdline")
    wait_until(lambda: b"/lib/formation_gnc/navigation" in shown.read_bytes(), "the name of its executable")
    assert os.getpgid(process.pid) == process.pid
    assert process.poll() is None
    os.killpg(process.pid, signal.SIGKILL)
    wait_until(lambda: process.poll() is not None, "the end")
    assert process.returncode == -signal.SIGKILL


def test_what_a_node_prints_is_in_its_log_and_its_status_is_told(server: ForkServer, tmp_path: Path) -> None:
    processes = [start(server, tmp_path / str(number), "-p", "tick:=-1.0") for number in range(3)]
    wait_until(lambda: all(each.poll() is not None for each in processes), "all ends")
    assert [each.returncode for each in processes] == [2, 2, 2]
    for number in range(3):
        (line,) = (tmp_path / str(number)).read_text().splitlines()
        assert line.startswith("navigation: ")
        assert "tick: -1.0 is not allowed" in line


def test_a_node_has_the_environment_of_its_start_and_no_other(server: ForkServer, tmp_path: Path) -> None:
    log = tmp_path / "log"
    process = start(server, log, RMW_IMPLEMENTATION="rmw_of_nobody")
    wait_until(lambda: process.poll() is not None, "the end")
    assert process.returncode != 0
    assert "rmw_of_nobody" in log.read_text()


def test_the_server_has_no_thread_that_a_fork_would_lack(server: ForkServer, tmp_path: Path) -> None:
    process = start(server, tmp_path / "log")  # which it does when it has imported everything
    parent = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[1]
    assert len(list(Path(f"/proc/{parent}/task").iterdir())) == 1
    os.killpg(process.pid, signal.SIGKILL)


def test_nodes_are_executables_where_a_plug_in_has_threads(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Which a fork would lack, and whose locks it might wait for."""
    (tmp_path / "threads.py").write_text(
        "import threading, time\n"
        "from formation_gnc.control.coast import Coast\n"
        "threading.Thread(target=time.sleep, args=(600.0,), daemon=True).start()\n"
        "class Waiting(Coast): pass\n"
    )
    (tmp_path / "threads-1.dist-info").mkdir()
    (tmp_path / "threads-1.dist-info/METADATA").write_text("Metadata-Version: 2.1\nName: threads\nVersion: 1\n")
    (tmp_path / "threads-1.dist-info/entry_points.txt").write_text("[formation_gnc.laws]\nwaiting = threads:Waiting\n")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ['PYTHONPATH']}")
    server = ForkServer()
    process = start(server, tmp_path / "log")
    shown = Path(f"/proc/{process.pid}/cmdline")
    wait_until(lambda: str(executable("navigation")).encode() in shown.read_bytes().split(b"\0"), "its own arguments")
    os.killpg(process.pid, signal.SIGKILL)
    wait_until(lambda: process.poll() is not None, "the end")
    assert process.returncode == -signal.SIGKILL


def test_nodes_of_a_killed_server_end_and_are_told_as_ended(tmp_path: Path) -> None:
    server = ForkServer()
    processes = [start(server, tmp_path / str(number)) for number in range(2)]
    parent = Path(f"/proc/{processes[0].pid}/stat").read_text().rpartition(")")[2].split()[1]
    os.kill(int(parent), signal.SIGKILL)
    wait_until(lambda: all(each.poll() is not None for each in processes), "the news")
    wait_until(lambda: not any(is_there(each.pid) for each in processes), "the ends")
    assert not server.is_alive
    with pytest.raises(OSError, match=r"."):
        start(server, tmp_path / "late")


def test_server_and_nodes_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    log = tmp_path / "log"
    scenario = find_scenario("leader_follower")
    arguments = ["--ros-args", "-r", "__ns:=/deputy1", "--params-file", str(scenario)]
    code = f"""
import os, sys
from pathlib import Path
from formation_gnc.transport.fork_server import fork_server
executable, log = Path({str(executable("navigation"))!r}), Path({str(log)!r})
process = fork_server().start(executable, {arguments}, dict(os.environ), log)
print(process.pid, flush=True)
sys.stdin.read()
"""
    environment = os.environ | {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
    ) as launcher:
        assert launcher.stdout is not None
        pid = int(launcher.stdout.readline())
        launcher.kill()
    wait_until(lambda: not is_there(pid), "the end of the node")
