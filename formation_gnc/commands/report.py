"""Report a recorded run as one self-contained HTML page, and as pictures.

The page works offline. It replays the run: the Earth with the orbit, the formation in the Hill frame with
targets, thrust, covariance and least separations, and the curves, moved by one slider. Below are figures of
merit, events, parameters and provenance. A bag with several runs gives a page for each.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from formation_gnc.commands.reading import numbered, print_remarks, runs_of
from formation_gnc.commands.replay import differences_of_replay
from formation_gnc.errors import ConfigurationError
from formation_gnc.recording.files import digest_of
from formation_gnc.recording.reader import Bag

if TYPE_CHECKING:
    from formation_gnc.analysis.run_history import RunHistory


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="bag directory or .mcap file")
    parser.add_argument("--output", metavar="FILE", type=Path, help="page to write (default: report.html in the bag)")
    parser.add_argument("--pictures", metavar="DIR", type=Path, help="directory for PNG files: overview and panels")
    parser.add_argument(
        "--replay", action="store_true", help="replay the run too; the page then tells whether it gives the same bits"
    )


def run(options: argparse.Namespace) -> int:
    """Read the bag, write the page and the pictures."""
    from formation_gnc.analysis.overview import draw_overview, draw_panels
    from formation_gnc.analysis.run_history import RunHistory

    bags = runs_of(options.bag)
    print_remarks(bags)
    title = options.bag.absolute().name
    directory = options.bag if options.bag.is_dir() else options.bag.parent
    page = options.output or directory / "report.html"
    try:
        for number, bag in enumerate(bags, 1):
            history, heading = RunHistory(bag), title if len(bags) == 1 else f"{title}, run {number}"
            path = write_page_of(bag, history, numbered(page, number, len(bags)), heading, options.replay)
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


def write_page_of(bag: Bag, history: "RunHistory", path: Path, title: str, replayed: bool) -> Path:
    """Write the page of a run, after a replay of it if `replayed`; returns its path."""
    from formation_gnc.analysis.report import Origin, write_report

    differences = [str(each) for each in differences_of_replay(bag)] if replayed else None
    return write_report(bag, history, path, title, Origin(str(bag.path), digest_of(bag.source), differences))
