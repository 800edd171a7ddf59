"""Report a recorded run as one self-contained HTML page, and as pictures.

The page works offline. It shows trajectories with a time slider, errors with 3-sigma bounds, measurements
and innovations, thrust, solver and timing with the events on every time axis, parameters and provenance.
A bag with several runs gives a page for each.
"""

import argparse
from pathlib import Path

from formation_gnc.commands.reading import numbered, print_remarks, runs_of
from formation_gnc.errors import ConfigurationError


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

    bags = runs_of(options.bag)
    print_remarks(bags)
    title = options.bag.absolute().name
    directory = options.bag if options.bag.is_dir() else options.bag.parent
    page = options.output or directory / "report.html"
    try:
        for number, bag in enumerate(bags, 1):
            history, heading = RunHistory(bag), title if len(bags) == 1 else f"{title}, run {number}"
            path = write_report(bag, history, numbered(page, number, len(bags)), heading)
            print(f"report: {path}")
            if options.pictures is not None:
                pictures = numbered(options.pictures, number, len(bags))
                pictures.mkdir(parents=True, exist_ok=True)
                overview = draw_overview(history, pictures / "overview.png", heading)
                for picture in [overview, *draw_panels(history, pictures)]:
                    print(f"picture: {picture}")
    except OSError as error:
        raise ConfigurationError(f"report {error.filename}: {error.strerror or error}") from None
    return 0
