"""Run all benchmarks, print a table and write build/bench.json."""

import dataclasses
import json
import sys
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from bench import campaign, control, dynamics, fleet, graph, navigation, plans, recording
from bench.result import Result

BENCHMARKS = {
    "graph": graph.run,
    "fleet": fleet.run,
    "dynamics": dynamics.run,
    "navigation": navigation.run,
    "control": control.run,
    "plans": plans.run,
    "recording": recording.run,
    "campaign": campaign.run,
}
OUTPUT = Path("build/bench.json")


def main(names: list[str]) -> int:
    """Run the named benchmarks, all without names; 1 when a goal is not reached."""
    console = Console(highlight=False)
    results: list[Result] = []
    for name in names or BENCHMARKS:
        console.print(f"measuring {name} ...")
        results += BENCHMARKS[name]()
    table = Table("what", "ours", "theirs", "unit", "ratio", "goal", "")
    for result in results:
        verdict = {True: "holds", False: "MISSED", None: ""}[result.holds]
        table.add_row(
            escape(result.name),
            f"{result.ours:,.4g}",
            f"{result.theirs:,.4g}",
            escape(result.unit),
            f"{result.ratio:.3g}",
            result.goal,
            verdict,
        )
    console.print(table)
    OUTPUT.parent.mkdir(exist_ok=True)
    OUTPUT.write_text(json.dumps([dataclasses.asdict(result) for result in results], indent=2) + "\n")
    console.print(f"written to {OUTPUT}")
    return int(any(result.holds is False for result in results))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
