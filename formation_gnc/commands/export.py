"""Export topics or trajectories of a recorded run, and the files attached to it.

A file per topic, such as `deputy1.estimate.csv` for /deputy1/estimate; a row per message, a column per field
or array element. A bag with several runs gives a file for each. In Python,
`formation_gnc.recording.read(bag)` returns the same as pandas frames.

The other formats hold the true trajectories of chief and deputies: `oem` (CCSDS) and `stk` (.e) with a file
for each satellite, `czml` (Cesium), `netcdf` (xarray) and `mat` (MATLAB) with one for all.
"""

import argparse
from pathlib import Path

from formation_gnc.commands.reading import numbered, print_remarks
from formation_gnc.errors import ConfigurationError
from formation_gnc.interchange.ephemeris import ephemerides
from formation_gnc.interchange.formats import OF_ALL, OF_ONE, write_trajectories
from formation_gnc.recording.export import export
from formation_gnc.recording.reader import Bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="bag directory or .mcap file")
    parser.add_argument(
        "--topic", metavar="NAME", action="append", help="topic to export, may be repeated (default: all)"
    )
    formats = ("csv", "parquet", *OF_ONE, *OF_ALL)
    parser.add_argument("--format", choices=formats, default="csv", help=f"{', '.join(formats)} (default: csv)")
    parser.add_argument("--attachments", action="store_true", help="export the attached files too")
    parser.add_argument("--output", metavar="DIR", type=Path, help="directory to write to (default: BAG_export)")


def run(options: argparse.Namespace) -> int:
    """Export the topics and print the paths."""
    bag = Bag(options.bag)
    print_remarks([bag])
    source = options.bag.absolute()
    directory = options.output or source.with_name(f"{source.stem}_export")
    if options.format in (*OF_ONE, *OF_ALL):
        if options.topic or options.attachments:
            raise ConfigurationError(f"format {options.format}: holds trajectories; neither --topic nor --attachments")
        return _export_trajectories(bag, options.format, directory, source.stem)
    filled = [name for name, topic in bag.topics.items() if topic.count]
    wanted = options.topic or [name for name in sorted(filled) if _is_read(bag, name)]
    if filled and not wanted:
        raise ConfigurationError(f"{options.bag}: no topic can be exported")
    runs = bag.runs() if bag.are_told_apart else [bag]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for number, run in enumerate(runs, 1):
            for topic in wanted:
                path = directory / f"{topic.strip('/').replace('/', '.')}.{options.format}"
                path = numbered(path, number, len(runs))
                export(run, topic, path)
                print(f"{topic}: {run.topics[topic].count} messages in {path}")
        for name, data in bag.attachments.items() if options.attachments else ():
            path = directory / Path(name).name
            path.write_bytes(data)
            print(f"{name}: {path}")
    except OSError as error:
        raise ConfigurationError(f"export to {error.filename}: {error.strerror}") from None
    return 0


def _export_trajectories(bag: Bag, kind: str, directory: Path, name: str) -> int:
    bag.check_own_types()
    runs = bag.runs()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for number, run in enumerate(runs, 1):
            stem = numbered(Path(name), number, len(runs)).name
            for path in write_trajectories(ephemerides(run), kind, directory, stem):
                print(path)
    except OSError as error:
        raise ConfigurationError(f"export to {error.filename}: {error.strerror}") from None
    return 0


def _is_read(bag: Bag, topic: str) -> bool:
    """Whether a topic can be decoded; prints the reason if not."""
    reason = bag.unread_reason(topic)
    if reason:
        print(f"skipped: {topic}: {reason}")
    return not reason
