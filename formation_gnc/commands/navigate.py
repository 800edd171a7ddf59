"""Feed a recorded run's measurements through a changed filter and print both filters' errors side by side.

Without the node graph, and with the parameters that flew unless --params changes them; unchanged,
the estimates are the recorded ones bit for bit. Errors are against the recorded truth.
"""

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from formation_gnc.analysis.navigation_figures import NavigationFigures, common_stamps, navigation_figures
from formation_gnc.commands.reading import print_remarks, runs_of
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics

if TYPE_CHECKING:
    from formation_gnc.recording.reader import Bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("bag", type=Path, help="directory of a recorded run, or an .mcap file")
    parser.add_argument(
        "--params",
        metavar="FILE",
        type=Path,
        help="ROS 2 parameter file whose navigation parameters go first",
    )
    parser.add_argument("--deputy", metavar="NAME", help="one deputy alone; all by default")
    parser.add_argument("--json", action="store_true", help="print the figures as one JSON object")


@dataclass(frozen=True)
class Comparison:
    """The recorded filter of a deputy and the replayed one, on the ticks that both answered."""

    recorded: NavigationFigures
    now: NavigationFigures
    identical: bool
    """Whether every estimate is the recorded one, bit for bit."""


def run(options: argparse.Namespace) -> int:
    """Replay the navigation of every deputy, compare, print."""
    bags = runs_of(options.bag)
    found = [_navigate(bag, options) for bag in bags]
    if options.json:
        each = [
            {
                "bag": str(options.bag),
                "deputies": {deputy: asdict(comparison) for deputy, comparison in comparisons.items()},
                "remarks": bag.remarks,
            }
            for bag, comparisons in zip(bags, found, strict=True)
        ]
        print(json.dumps(each[0] if len(each) == 1 else {"bag": str(options.bag), "runs": each}, indent=2))
        return 0
    print_remarks(bags)
    console = Console(highlight=False)
    for bag, comparisons in zip(bags, found, strict=True):
        for deputy, comparison in comparisons.items():
            console.print(_table(deputy if len(bags) == 1 else f"{bag.path.name}, {deputy}", comparison))
            said = "the recorded ones, bit for bit" if comparison.identical else "not the recorded ones"
            console.print(f"{comparison.now.estimates} estimates: {said}")
    return 0


def _navigate(bag: "Bag", options: argparse.Namespace) -> dict[str, Comparison]:
    """Replay the navigation of a run; returns a comparison for each deputy that is asked for."""
    from formation_gnc.analysis.trajectory import deputies_of, has_messages
    from formation_gnc.recording.reader import Bag
    from formation_gnc.sil.replay_recorder import replay_into

    known = deputies_of(bag)
    if options.deputy is not None and options.deputy not in known:
        raise ConfigurationError(f"deputy {options.deputy}: not in {options.bag}; it has {', '.join(known)}")
    with tempfile.TemporaryDirectory(prefix="formation_gnc-") as directory:
        replayed = Path(directory) / "replay"
        replay_into(bag, replayed, ["navigation"], options.params)
        deputies, now = [options.deputy] if options.deputy else known, Bag(replayed)
        for deputy in deputies:
            if not has_messages(now, topics.ESTIMATE.of(deputy)):
                raise ConfigurationError(f"{bag.path}: no estimate of {deputy}: no measurement has an acquisition fix")
        return {deputy: _compare(bag, now, deputy) for deputy in deputies}


def _compare(recorded: "Bag", replayed: "Bag", deputy: str) -> Comparison:
    from formation_gnc.recording.difference import identical

    stamps = common_stamps(recorded, replayed, deputy)
    return Comparison(
        navigation_figures(recorded, deputy, stamps),
        navigation_figures(replayed, deputy, stamps),
        not identical(recorded, replayed, [topics.ESTIMATE.of(deputy)]),
    )


def _table(deputy: str, comparison: Comparison) -> Table:
    table = Table(title=f"{deputy}: estimate against truth", title_justify="left")
    table.add_column("figure")
    sides = {"recorded": comparison.recorded, "now": comparison.now}
    for name in sides:
        table.add_column(name, justify="right")
    rows = {
        "RMS position error [m]": [f"{each.position_rms_m:.4f}" for each in sides.values()],
        "RMS error x, y, z [m]": [
            ", ".join(f"{axis:.3f}" for axis in each.position_axes_rms_m) for each in sides.values()
        ],
        "RMS velocity error [mm/s]": [f"{1e3 * each.velocity_rms_m_s:.4f}" for each in sides.values()],
        "final position error [m]": [f"{each.final_position_m:.4f}" for each in sides.values()],
        "errors within 3 sigma [%]": [f"{100.0 * each.within_3_sigma:.2f}" for each in sides.values()],
        "mean NEES (6 is consistent) [-]": [f"{each.mean_nees:.3f}" for each in sides.values()],
        "mean NIS [-]": [f"{each.mean_nis:.3f}" for each in sides.values()],
        "readings used": [f"{each.readings}" for each in sides.values()],
        "rejected": [
            ", ".join(f"{reason} {count}" for reason, count in each.rejections.items()) or "none"
            for each in sides.values()
        ],
    }
    for label, values in rows.items():
        table.add_row(label.replace("[", r"\["), *values)
    return table
