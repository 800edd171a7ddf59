"""Fast starts of node processes: a fork server, which has imported what every node imports.

A process that imports NumPy, SciPy, Numba and the compiled kernels takes seconds before its first line of its own;
six of them on two cores are most of a short flight. So one process does it for all, and each node is a fork of it: a
process and process group of its own, with its own environment and log, and what `ros2 run` would have started in
everything else. The server leaves rclpy alone, which starts threads when it is imported: a fork has none of them, and
may wait for ever for what they hold. Where a plug-in starts some, nodes are their executables, started as by hand.
"""

import ctypes
import faulthandler
import gc
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path
from threading import Lock
from typing import Any, NoReturn

from setproctitle import setproctitle

DISTRIBUTION = "formation-gnc"
PR_SET_PDEATHSIG = 1  # from <linux/prctl.h>
LONGEST_MESSAGE = 1 << 20

_IMPORTED = ("messages.conversion", "plant.plant", "recording.session", "sil.plant_executive")
"""Modules that nodes import, besides those of the graph table."""


@dataclass(eq=False)
class ForkedProcess:
    """A process that the fork server started, as `subprocess.Popen` shows one."""

    pid: int
    _server: "ForkServer"
    returncode: int | None = field(default=None, init=False)
    """Exit status once it has ended, negative for the signal that ended it; None while it lives."""

    def poll(self) -> int | None:
        """`returncode`, looked at again."""
        self._server.collect()
        return self.returncode


class ForkServer:
    """The launcher's end of a fork server, which lives as long as this process does."""

    def __init__(self) -> None:
        """Start it; it imports while this process goes on."""
        self._socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with other:
            # In a session of its own, where no Ctrl-C reaches it and its forks: its end is that of the socket.
            self._server = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, str(other.fileno())],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._lock = Lock()
        self._living: dict[int, ForkedProcess] = {}

    @property
    def is_alive(self) -> bool:
        """Whether it can start anything."""
        return self._server.poll() is None

    def start(self, executable: Path, arguments: list[str], environment: dict[str, str], log: Path) -> ForkedProcess:
        """Start a node's executable; what it prints is appended to `log`.

        Raises:
            OSError: the server is gone.
        """
        request = {
            "executable": str(executable),
            "arguments": arguments,
            "environment": environment,
            "directory": str(Path.cwd()),
            "log": str(log),
        }
        with self._lock:
            self._socket.send(json.dumps(request).encode())
            while "started" not in (reply := self._receive()):
                self._note(reply)
            process = ForkedProcess(reply["started"], self)
            self._living[process.pid] = process
            return process

    def collect(self) -> None:
        """Take in which processes have ended."""
        with self._lock, selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            while self._living and selector.select(0.0):
                try:
                    self._note(self._receive())
                except OSError:  # the server is gone, and the kernel ends the nodes: none of them unsaid
                    for process in self._living.values():
                        process.returncode = -signal.SIGTERM
                    self._living.clear()

    def _receive(self) -> dict[str, int]:
        if not (message := self._socket.recv(LONGEST_MESSAGE)):
            raise ConnectionResetError("the fork server has ended")
        reply: dict[str, int] = json.loads(message)
        return reply

    def _note(self, reply: dict[str, int]) -> None:
        if process := self._living.pop(reply["ended"], None):
            process.returncode = reply["status"]


_servers: list[ForkServer] = []


def fork_server() -> ForkServer:
    """The fork server of this process; started at its first use, which may be long before it is needed."""
    if not _servers or not _servers[-1].is_alive:
        _servers.append(ForkServer())
    return _servers[-1]


def _serve(requests: socket.socket) -> None:
    """Fork a process for every request until the launcher is gone, and tell which have ended."""
    with suppress(Exception):  # a plug-in that cannot be imported: the node that needs it says so in its own log
        _import_core()
    gc.collect()
    gc.freeze()  # what is imported stays as it is, and its pages shared
    warnings.filterwarnings("ignore", category=DeprecationWarning, message=".*fork")  # forks of threads are replaced
    with selectors.DefaultSelector() as selector:
        selector.register(requests, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fileobj is not requests:  # a process has ended
                    selector.unregister(key.fileobj)
                    os.close(key.fd)
                    _, status = os.waitpid(key.data, 0)
                    _tell(requests, {"ended": key.data, "status": os.waitstatus_to_exitcode(status)})
                elif request := _request(requests):
                    pid = _fork(requests, request)
                    selector.register(os.pidfd_open(pid), selectors.EVENT_READ, pid)
                    _tell(requests, {"started": pid})
                else:
                    return


def _import_core() -> None:
    """Import the flight software: all flight modules with their parameters, and what other nodes carry messages to."""
    from formation_gnc.flight.graph import GRAPH

    for module in _IMPORTED:
        import_module(f"formation_gnc.{module}")
    for row in GRAPH:
        _ = row.module, row.parameters


def _request(requests: socket.socket) -> dict[str, Any] | None:
    """What the launcher asks for; None when it is gone."""
    try:
        message = requests.recv(LONGEST_MESSAGE)
    except ConnectionResetError:
        return None
    request: dict[str, Any] | None = json.loads(message or "null")
    return request


def _tell(launcher: socket.socket, reply: dict[str, int]) -> None:
    with suppress(OSError):  # it is gone; the next request says so
        launcher.send(json.dumps(reply).encode())


def _fork(requests: socket.socket, request: dict[str, Any]) -> int:
    server, has_threads = os.getpid(), len(list(Path("/proc/self/task").iterdir())) > 1
    if pid := os.fork():
        os.setpgid(pid, pid)  # by now, since what it is told next may be to stop
        return pid
    try:
        requests.close()  # a copy of the server's end, which would keep the launcher's from ending
        _become(server, has_threads, **request)
    except BaseException:
        sys.excepthook(*sys.exc_info())  # which executables make a line of, and the exit status, for what is refused
    finally:
        os._exit(1)


def _become(
    server: int,
    has_threads: bool,
    executable: str,
    arguments: list[str],
    environment: dict[str, str],
    directory: str,
    log: str,
) -> NoReturn:
    """Be the process of a node, which never returns from its main function."""
    end_with_parent()
    if os.getppid() != server:  # it ended before the kernel knew
        os._exit(1)
    _attach(Path(log))
    os.chdir(directory)
    if has_threads:
        os.execve(executable, [executable, *arguments], environment)
    setproctitle(" ".join((sys.executable, executable, *arguments)))  # before it changes what it finds its place by
    os.environ.clear()
    os.environ.update(environment)
    if environment.get("PYTHONFAULTHANDLER"):  # the one of Python's own that a start would heed, and nodes need
        faulthandler.enable()
    sys.argv = [executable, *arguments]
    _main(Path(executable).name)()
    os._exit(0)


def _attach(log: Path) -> None:
    """Let this process read nothing, and print into its log."""
    for number, path, flags in (
        (0, Path(os.devnull), os.O_RDONLY),
        (1, log, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
        (2, log, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
    ):
        opened = os.open(path, flags, 0o666)
        os.dup2(opened, number)
        os.close(opened)


def _main(name: str) -> Any:
    """What an executable of this package runs."""
    scripts: Iterator[Any] = (
        each for each in distribution(DISTRIBUTION).entry_points if (each.group, each.name) == ("console_scripts", name)
    )
    return next(scripts).load()


def end_with_parent() -> None:
    """Let the kernel send SIGTERM to this process when the one that started it is gone, however it went."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
