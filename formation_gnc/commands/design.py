"""Design the control law of a scenario and report it, without a flight.

Gains, closed-loop poles, margins, gamma, horizon and size of the QP, as applicable to the law.
"""

import argparse
import json
from itertools import batched
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import ConfigurationError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("scenario", help="name of a scenario in params/, or a ROS 2 parameter file")
    parser.add_argument("--controller", metavar="NAME", help=f"control law: {', '.join(ALGORITHMS)}")
    parser.add_argument("--deputy", metavar="NAME", help="deputy whose controller to design (default: the first)")
    parser.add_argument(
        "--plot",
        metavar="FILE",
        type=Path,
        help="plot singular values, poles and recovery: .png, .pdf or .svg",
    )
    parser.add_argument(
        "--export-c",
        metavar="DIR",
        type=Path,
        help="write the mpc as C to a new folder: its data, OSQP's generated code, and a replay of recorded inputs",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Design, draw, print."""
    from formation_gnc.analysis.design_report import Design, design, draw
    from formation_gnc.sil.scenario import load_scenario

    if options.plot is not None and options.plot.suffix not in (".png", ".pdf", ".svg"):
        raise ConfigurationError(f"plot {options.plot}: is not allowed; it must be a .png, .pdf or .svg file")
    chosen = {} if options.controller is None else {"algorithm": options.controller}
    scenario = load_scenario(options.scenario, {"/**/controller": chosen})
    deputy = options.deputy or next(iter(scenario.deputies))
    if deputy not in scenario.deputies:
        known = ", ".join(scenario.deputies)
        raise ConfigurationError(f"deputy {deputy}: not in {scenario.name}; it has {known}")
    try:
        designed: Design = design(scenario.deputies[deputy]["controller"])
    except ConfigurationError as error:
        raise ConfigurationError(f"{scenario.name}: /{deputy}/controller: {error}") from None
    if options.export_c is not None:
        _export(scenario.deputies[deputy]["controller"], options.export_c)
    if options.plot is not None:
        try:
            draw(designed, options.plot)
        except OSError as error:
            raise ConfigurationError(f"plot {options.plot}: {error.strerror or error}") from None
    if options.json:
        summary = {
            "scenario": scenario.name,
            "deputy": deputy,
            "algorithm": designed.algorithm,
            "figures": designed.figures,
            "poles_1_s": [[pole.real, pole.imag] for pole in designed.poles],
        }
        print(json.dumps(summary, indent=2))
        return 0
    console = Console(highlight=False)
    table = Table(title=f"{scenario.name}, {deputy}: {designed.algorithm}", title_justify="left")
    table.add_column("figure")
    table.add_column("value", no_wrap=True)
    poles = "\n".join(f"{pole.real:.4g} {pole.imag:+.4g}i" for pole in designed.poles)
    rows = designed.figures | ({"closed-loop poles [1/s]": poles} if poles else {})
    for name, value in rows.items():
        table.add_row(escape(name), escape(_text(value)))
    console.print(table)
    for what, path in (("plot", options.plot), ("C", options.export_c)):
        if path is not None:
            console.print(f"{what}: {path}", soft_wrap=True)
    return 0


def _export(parameters: Any, directory: Path) -> None:
    """Write the controller of a deputy as C."""
    from formation_gnc.control.c_export import export_mpc
    from formation_gnc.control.controller import Vehicle

    if parameters.algorithm != "mpc":
        raise ConfigurationError(f"export-c: {parameters.algorithm} cannot be exported; it must be mpc")
    try:
        vehicle = Vehicle(parameters.mass, np.array(parameters.thrust_limit))
        export_mpc(parameters.laws["mpc"], parameters, vehicle, directory)
    except OSError as error:
        raise ConfigurationError(f"export-c {directory}: {error.strerror or error}") from None


def _text(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, list):
        rows = value if isinstance(value[0], list) else batched(value, 6)
        return "\n".join(" ".join(f"{each:8.3g}" for each in row) for row in rows)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
