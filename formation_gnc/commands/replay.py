"""Fly recorded measurements through the software again, and record the new run.

Unchanged, it gives the recorded outputs bit for bit, and exit status 1 if it does not. With --params the
named nodes fly with other parameters: the truth stays the recorded one, so that a changed controller says
what it would have commanded, and nothing answers it. What is not named is taken from the bag.
"""

import argparse
import sys
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.commands.reading import numbered, print_remarks, runs_of
from formation_gnc.flight.graph import MODULES
from formation_gnc.recording import Bag, identical
from formation_gnc.recording.arithmetic import ARITHMETIC, difference_of_arithmetic
from formation_gnc.recording.difference import Difference


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("recorded", metavar="bag", type=Path, help="bag to fly again")
    parser.add_argument(
        "--nodes",
        metavar="NAMES",
        help=f"which to fly again, with commas (default: those of {','.join(MODULES)} that the bag has parameters of)",
    )
    parser.add_argument(
        "--params", metavar="FILE", type=Path, help="ROS 2 parameter file that overrides what is recorded"
    )
    parser.add_argument(
        "--bag", metavar="DIR", type=Path, help="directory to make for the new bag (default: BAG_replay_DATE)"
    )


def run(options: argparse.Namespace) -> int:
    """Replay, record, compare."""
    bags = runs_of(options.recorded)
    print_remarks(bags)
    source = options.recorded.absolute()
    output = options.bag or source.with_name(f"{source.stem}_replay_{datetime.now(UTC):%Y-%m-%d_%H-%M-%S}")
    reproduced = [_replay(bag, numbered(output, number, len(bags)), options) for number, bag in enumerate(bags, 1)]
    if not all(reproduced) and options.params is None:
        print("formation-gnc: the replay does not give the recorded outputs", file=sys.stderr)
        return 1
    return 0


def differences_of_replay(bag: Bag) -> list[Difference]:
    """Replay a run unchanged, into a bag that is not kept, and compare; empty when both are identical.

    Raises:
        ConfigurationError: the recorded parameters cannot be flown.
    """
    from formation_gnc.sil.replay_recorder import replay_into

    with TemporaryDirectory(prefix="formation_gnc-") as directory:
        output = Path(directory) / "replay"
        replay_into(bag, output, None, None)
        replayed = Bag(output)
        return identical(bag, replayed, gnc_topics(bag, replayed))


def _replay(bag: Bag, output: Path, options: argparse.Namespace) -> bool:
    """Replay one run and compare; returns whether both are identical."""
    from formation_gnc.sil.replay_recorder import replay_into

    remarks = replay_into(bag, output, options.nodes.split(",") if options.nodes else None, options.params)
    print(f"bag: {output}")
    for remark in remarks:
        print(remark)
    replayed = Bag(output)
    differences = identical(bag, replayed, gnc_topics(bag, replayed))
    for difference in differences:
        print(f"differs: {difference}")
    machines = difference_of_arithmetic(bag.metadata.get(ARITHMETIC, {}))
    if differences and machines:
        print(f"recorded with another arithmetic, which changes last bits: {machines}")
    if not differences:
        print("identical on every GNC topic")
    return not differences
