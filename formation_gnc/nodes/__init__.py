"""Executables of the nodes.

An executable that is interrupted while it is still being imported ends by the signal, without a traceback.
"""

import signal
import sys
from pathlib import Path

if Path(sys.argv[0]).parent.name == "formation_gnc":  # where `ros2 run` finds executables
    signal.signal(signal.SIGINT, signal.SIG_DFL)
