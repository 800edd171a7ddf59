"""The executable of every flight module: its name selects the row of the graph table."""

import sys
from pathlib import Path

from formation_gnc.flight.graph import MODULES
from formation_gnc.transport.module_node import ModuleNode
from formation_gnc.transport.process import run


def main() -> None:
    """Run the module of the executable's name."""
    run(lambda: ModuleNode(MODULES[Path(sys.argv[0]).name]))
