"""Recover what is readable of a bag that was cut or damaged.

Exit status: 0 when the bag is whole, or only lacks its index; 3 when messages are lost, which are listed; 1
when there is nothing to save.
"""

import argparse
import dataclasses
import json
import sys
from pathlib import Path

from formation_gnc.recording.recover import NOTHING_SAVED, recover


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="bag directory, .mcap or .db3 file")
    parser.add_argument(
        "--output",
        metavar="DIR",
        type=Path,
        help="directory to make (default: BAG_recovered)",
    )
    parser.add_argument("--verify", action="store_true", help="decode every message, and write nothing")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Recover the bag and print what is lost."""
    bag = options.bag.absolute()
    try:
        output = None if options.verify else options.output or bag.with_name(f"{bag.stem}_recovered")
        recovery = recover(options.bag, output)
    except OSError as error:
        print(f"formation-gnc: {error.filename}: {error.strerror}", file=sys.stderr)
        return NOTHING_SAVED
    if options.json:
        print(json.dumps(dataclasses.asdict(recovery), default=str, indent=2))
        return recovery.status
    for reason in recovery.reasons:
        print(f"damaged: {reason}")
    for topic, count in sorted(recovery.lost.items()):
        print(f"lost: {count} messages of {topic}")
    if recovery.output is not None:
        print(f"{recovery.saved} messages saved in {recovery.output}")
    elif recovery.status == NOTHING_SAVED:
        print("nothing to save")
    elif recovery.reasons:
        print(f"{recovery.saved} messages can be saved")
    else:
        print(f"whole: {recovery.saved} messages")
    return recovery.status
