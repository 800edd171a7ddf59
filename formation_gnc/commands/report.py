"""Report a recorded run as one self-contained HTML page, and as pictures.

The page works offline. It shows trajectories with a time slider, errors with 3-sigma bounds, measurements
and innovations, thrust, solver and timing with the events on every time axis, parameters and provenance.
"""

import argparse
from pathlib import Path

from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.reader import Bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="bag directory or .mcap file")
    parser.add_argument("--output", metavar="FILE", type=Path, help="page to write (default: report.html in the bag)")
    parser.add_argument("--pictures", metavar="DIR", type=Path, help="directory for PNG files: overview and panels")


def run(options: argparse.Namespace) -> int:
    """Read the bag, write the page and the pictures."""
    from formation_gnc.analysis.overview import draw_overview, draw_panels
    from formation_gnc.analysis.report import write_report
    from formation_gnc.analysis.run_history import RunHistory

    bag = Bag(options.bag)
    title = options.bag.absolute().name
    directory = options.bag if options.bag.is_dir() else options.bag.parent
    page = options.output or directory / "report.html"
    history = RunHistory(bag)
    try:
        write_report(bag, history, page, title)
        print(f"report: {page}")
        if options.pictures is not None:
            options.pictures.mkdir(parents=True, exist_ok=True)
            overview = draw_overview(history, options.pictures / "overview.png", title)
            for picture in [overview, *draw_panels(history, options.pictures)]:
                print(f"picture: {picture}")
    except OSError as error:
        raise ConfigurationError(f"report {error.filename}: {error.strerror or error}") from None
    return 0
