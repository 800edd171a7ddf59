"""The process of a node: signals, exit status, and the order of its end."""

import faulthandler
import gc
import os
import signal
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Timer
from typing import NoReturn, Protocol

import rclpy
from rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, RMWError, UnknownROSArgsError
from rclpy.signals import SignalHandlerOptions

from formation_gnc.errors import ConfigurationError, ImpactError, RecorderLostError

REJECTED_BY_ROS = (RCLInvalidROSArgsError, UnknownROSArgsError, RCLError, RMWError)
"""What rclpy raises for arguments, parameter files and middleware it cannot use."""

LONGEST_END = 10.0
"""Wall time (s) that a node has to leave the graph."""

HUNG = 5.0
"""Wall time (s) beyond LONGEST_END after which the middleware holds the interpreter, and none of its threads runs."""

_stop_signals: list[int] = []
"""Plain list: signal handlers must not lock."""


class Executable(Protocol):
    """What a process runs: a node, or several."""

    def spin(self) -> None:
        """Work to the end, or until `stop_requested`."""

    def destroy_node(self) -> None:
        """Leave the graph."""


def stop_requested() -> bool:
    """Whether SIGINT, SIGTERM or SIGHUP has come."""
    return bool(_stop_signals)


def leave(status: int) -> NoReturn:
    """End this process at once.

    Not by Python's way, which runs the destructors of the middleware while threads of it may live: these then wait
    for one another for ever.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # a terminal that was closed, or none
            stream.flush()
    os._exit(status)


def run[E: Executable](make: Callable[[], E], work: Callable[[E], None] | None = None) -> NoReturn:
    """Body of every executable: make the node, let it work, and end the process with the exit status.

    A signal is only noted, since a node that has been asked to stop still has to hand over what it published
    or recorded.

    Args:
        make: the node.
        work: what it does until its end; its `spin` by default.

    The exit status is 0 after an ordinary end or an interruption, 1 when a satellite came down, the recorder is lost,
    the disk failed or the middleware holds the interpreter at the end, 2 when something given to the node is not
    allowed.
    """
    node, status = None, 1
    name = Path(sys.argv[0]).name
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: _stop_signals.append(number))
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
        gc.freeze()  # what was built lives to the end: no use scanning it again and again
        work(node) if work else node.spin()
        status = 0
    except (ConfigurationError, *REJECTED_BY_ROS) as rejection:
        print(f"{name}: {' '.join(str(rejection).split())}", file=sys.stderr)
        status = 2
    except (ImpactError, RecorderLostError, OSError) as end:
        print(f"{name}: {end}", file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    watchdog = Timer(LONGEST_END, os._exit, (status,))
    watchdog.daemon = True
    watchdog.start()
    with suppress(OSError, RuntimeError, ValueError):  # no standard error to write to
        faulthandler.dump_traceback_later(LONGEST_END + HUNG, exit=True)  # from a thread that needs no interpreter
    try:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    except BaseException:
        traceback.print_exc()
    leave(status)
