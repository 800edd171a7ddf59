"""The process of a node: signals, exit status, and the order of its end."""

import gc
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import rclpy
from rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, RMWError, UnknownROSArgsError
from rclpy.signals import SignalHandlerOptions

from formation_gnc.errors import ConfigurationError, ImpactError

REJECTED_BY_ROS = (RCLInvalidROSArgsError, UnknownROSArgsError, RCLError, RMWError)
"""What rclpy raises for arguments, parameter files and middleware it cannot use."""

_stop_signals: list[int] = []
"""Plain list: signal handlers must not lock."""


class Executable(Protocol):
    """What a process runs: a node, or several."""

    def spin(self) -> None:
        """Work to the end, or until `stop_requested`."""

    def destroy_node(self) -> None:
        """Leave the graph."""


def stop_requested() -> bool:
    """Whether SIGINT or SIGTERM has come."""
    return bool(_stop_signals)


def run[E: Executable](make: Callable[[], E], work: Callable[[E], None] | None = None) -> int:
    """Body of every executable: make the node, let it work, and end with the exit status.

    A signal is only noted, since a node that has been asked to stop still has to hand over what it published
    or recorded.

    Args:
        make: the node.
        work: what it does until its end; its `spin` by default.

    Returns:
        0 after an ordinary end or an interruption, 1 when a satellite came down or the disk failed, 2 when
        something given to the node is not allowed.
    """
    node = None
    name = Path(sys.argv[0]).name
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: _stop_signals.append(number))
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
        gc.freeze()  # what was built lives to the end: no use scanning it again and again
        work(node) if work else node.spin()
    except (ConfigurationError, *REJECTED_BY_ROS) as rejection:
        print(f"{name}: {' '.join(str(rejection).split())}", file=sys.stderr)
        return 2
    except (ImpactError, OSError) as end:
        print(f"{name}: {end}", file=sys.stderr)
        return 1
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
