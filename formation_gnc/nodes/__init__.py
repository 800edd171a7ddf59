"""Executables of the nodes.

An executable that is interrupted while it is still being imported ends by the signal, without a traceback. One
whose modules refuse something while they are imported, such as a plug-in, says so in one line.
"""

import os
import signal
import sys
from pathlib import Path
from types import TracebackType

from formation_gnc.errors import ConfigurationError


def _end_with_a_line(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if not issubclass(kind, ConfigurationError):
        sys.__excepthook__(kind, error, trace)
        return
    print(f"{Path(sys.argv[0]).name}: {' '.join(str(error).split())}", file=sys.stderr, flush=True)
    os._exit(2)  # a hook cannot set the exit status otherwise


if Path(sys.argv[0]).parent.name == "formation_gnc":  # where `ros2 run` finds executables
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.excepthook = _end_with_a_line
