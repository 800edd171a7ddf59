"""Feed a recorded run's measurements through a changed filter and print both filters' errors side by side.

Without the node graph, and with the parameters that flew unless --params changes them; unchanged,
the estimates are the recorded ones bit for bit. Errors are against the recorded truth.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from formation_gnc.errors import ConfigurationError


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


def run(options: argparse.Namespace) -> int:
    """Fly the filter again, compare, print."""
    from formation_gnc.analysis.metrics import deputies_of
    from formation_gnc.navigation.open_loop import Comparison, as_json, compare
    from formation_gnc.recording.reader import Bag
    from formation_gnc.sil.scenario import given_to

    bag = Bag(options.bag)
    known = deputies_of(bag)
    if options.deputy is not None and options.deputy not in known:
        raise ConfigurationError(f"deputy {options.deputy}: not in {options.bag}; it has {', '.join(known)}")
    comparisons: list[Comparison] = []
    for deputy in [options.deputy] if options.deputy else known:
        node = f"/{deputy}/navigation"
        comparisons.append(compare(bag, deputy, given_to(options.params, node) if options.params else {}))
    if options.json:
        print(json.dumps({"bag": str(options.bag), "deputies": {c.deputy: as_json(c) for c in comparisons}}, indent=2))
        return 0
    console = Console(highlight=False)
    for comparison in comparisons:
        console.print(_table(comparison))
        said = "the recorded ones, bit for bit" if comparison.identical else "not the recorded ones"
        console.print(f"{comparison.now.estimates} estimates: {said}")
    return 0


def _table(comparison: Any) -> Table:
    table = Table(title=f"{comparison.deputy}: estimate against truth", title_justify="left")
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
