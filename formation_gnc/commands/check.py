"""Check a scenario without flying it: its values and where each comes from, and what an engineer would warn of.

Exit status 0 also with warnings; 2 when the scenario cannot be flown.
"""

import argparse
import json
from collections.abc import Sized
from typing import Any

from rich.console import Console

from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.flight.graph import PLANT
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.sil.following import SHARED, leader_of
from formation_gnc.sil.overrides import overrides_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("scenario", help="name of a scenario in params/, or a ROS 2 parameter file")
    parser.add_argument(
        "--set",
        metavar="NODE.PARAMETER=VALUE",
        action="append",
        default=[],
        help="any parameter of a node, as for `formation-gnc sil`; repeatable",
    )
    parser.add_argument("--all", action="store_true", help="show defaults, and laws and formations not in force, too")
    parser.add_argument("--json", action="store_true", help="print values, sources, warnings and notes as JSON")


def run(options: argparse.Namespace) -> int:
    """Load, look, print."""
    from formation_gnc.commands.tables import print_table
    from formation_gnc.parameters import leaves, to_json
    from formation_gnc.sil import preflight
    from formation_gnc.sil.scenario import load_scenario, sources

    overrides = overrides_of(options.set)
    scenario = load_scenario(options.scenario, overrides)
    warnings, notes = preflight.warnings(scenario), preflight.notes(scenario)
    schemas: dict[str, Any] = {"/plant": scenario.plant}
    for deputy, modules in scenario.deputies.items():
        schemas |= {f"/{deputy}/{module}": parameters for module, parameters in modules.items()}
    found: dict[str, dict[str, Any]] = {}
    for node, values in scenario.parameters().items():
        given = sources(options.scenario, overrides, node)
        deputy = node.split("/")[1] if node.count("/") > 1 else ""
        known = leaves(type(schemas[node]), values)
        found[node] = {
            leaf.name: {
                "value": values[leaf.name],
                "unit": leaf.limits.unit,
                "source": given.get(leaf.name) or ("the plant's" if deputy and leader_of(leaf, deputy) else "default"),
            }
            for leaf in known
        }
    if options.json:
        document = {"scenario": scenario.name, "parameters": found, "warnings": warnings, "notes": notes}
        print(json.dumps(document, indent=2))
        return 0
    console = Console(highlight=False)
    for node, values in found.items():
        rows = [
            (name, to_json(each["value"]) + (f" {each['unit']}" if each["unit"] else ""), each["source"])
            for name, each in values.items()
            if options.all or _is_of_interest(node, name, each["source"], values)
        ]
        if rows:
            columns = list(zip(("parameter", "value", "from"), *rows, strict=True))
            print_table(console, columns, node)
    for kind, lines in (("warning", warnings), ("note", notes)):
        for line in lines:
            console.print(f"{kind}: {line}", soft_wrap=True)
    console.print(f"{scenario.name}: can be flown; {_counted(warnings, 'warning')}, {_counted(notes, 'note')}")
    return 0


def _is_of_interest(node: str, name: str, source: str, values: dict[str, Any]) -> bool:
    """Whether a parameter is given, not shared with the plant, and of the law and formation in force."""
    if source in ("default", "the plant's") or (node != PLANT and name in SHARED):
        return False
    group, dot, _ = name.partition(".")
    return not dot or group not in {*ALGORITHMS, *FORMATIONS} or group in _in_force(values)


def _in_force(values: dict[str, Any]) -> set[str]:
    """The law and the formation of a node."""
    return {str(values[name]["value"]) for name in ("algorithm", "formation") if name in values}


def _counted(found: Sized, name: str) -> str:
    return f"{len(found)} {name if len(found) == 1 else name + 's'}"
