"""Write a recorded run as one self-contained HTML page.

The page works offline: trajectory with a time slider, errors with 3-sigma bounds, measurements and
innovations, thrust, timing, events on every time axis, parameters and provenance.
"""

import argparse
from pathlib import Path

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.reader import Bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="bag directory or .mcap file")
    parser.add_argument(
        "--output", metavar="FILE", type=Path, help="page to write (default: report.html in the bag)"
    )


def run(options: argparse.Namespace) -> int:
    """Read, draw, write."""
    from formation_gnc.analysis.report import write_report

    bag = Bag(options.bag)
    directory = options.bag if options.bag.is_dir() else options.bag.parent
    path = options.output or directory / "report.html"
    try:
        write_report(bag, path, options.bag.absolute().name)
    except OSError as error:
        raise ConfigurationError(f"report {path}: {error.strerror or error}") from None
    print(f"report: {path}")
    return 0
