"""Write a scenario of one's own, from another scenario or from the orbits of satellites.

From a scenario, the new file extends it and names what is often changed. From a TLE or an OEM, the first satellite
becomes the chief, the others its deputies, which are to stay on their relative orbits.
"""

import argparse
from math import degrees
from pathlib import Path

from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.units import EPOCH_UNIT, to_si

BASE = "leader_follower"
"""Scenario whose sensors, thrusters and laws a scenario from orbits begins with."""

ORBITS = (".tle", ".txt", ".oem", ".2le", ".3le")
"""Suffixes of files of orbits."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("name", help="name of the new scenario: NAME.yaml is written")
    parser.add_argument(
        "--from",
        dest="sources",
        metavar="SOURCE",
        nargs="+",
        default=[BASE],
        help=f"a scenario, or files with TLE or OEM of one satellite or more ({', '.join(ORBITS)}); default: {BASE}",
    )
    parser.add_argument("--epoch", metavar="DATE", help="start of the run in UTC, as 2026-11-28T12:00:00Z")
    parser.add_argument("--duration", metavar="S", default="1 d", help="of the run; default: 1 d")


def run(options: argparse.Namespace) -> int:
    """Read, write, check."""
    from formation_gnc.sil.scenario import load_scenario

    path = Path(options.name).with_suffix(".yaml")
    if path.exists():
        raise ConfigurationError(f"scenario {path}: exists already; choose another name")
    if all(Path(source).suffix.lower() in ORBITS for source in options.sources):
        text = _of_orbits([Path(source) for source in options.sources], options.epoch, options.duration)
    elif len(options.sources) == 1:
        text = _of_scenario(options.sources[0])
    else:
        raise ConfigurationError(f"from {' '.join(options.sources)}: must be one scenario, or files of orbits alone")
    path.write_text(text, encoding="utf-8")
    try:
        load_scenario(str(path))
    except ConfigurationError:
        path.unlink()
        raise
    print(f"{path}: written; formation-gnc check {path}")
    return 0


def _of_scenario(base: str) -> str:
    from formation_gnc.parameters import leaves, to_json
    from formation_gnc.sil.scenario import load_scenario

    scenario = load_scenario(base)
    deputy, modules = next(iter(scenario.deputies.items()))
    controller = modules["controller"]
    wanted = {
        "/**": (scenario.plant, ("chief.", "tick", "epoch")),
        "/plant": (scenario.plant, ("duration", "seed", f"{deputy}.relative_state", f"{deputy}.mass", "forces.")),
        "/**/controller": (controller, ("algorithm", f"{controller.algorithm}.")),
    }
    text = f"""# Begins as {scenario.name}; what is not given here is as there (`formation-gnc check` shows it).
# Change what you like, and leave out the rest. Values are SI, or text with a unit, as 700 km.
extends: {base}
"""
    nodes = scenario.parameters()
    for pattern, (parameters, names) in wanted.items():
        values = nodes["/plant"] if parameters is scenario.plant else nodes[f"/{deputy}/controller"]
        text += f"\n{pattern}:\n  ros__parameters:\n"
        for leaf in leaves(type(parameters), values):
            if leaf.name.startswith(names) and values[leaf.name] != ():
                unit = f"{leaf.limits.unit}; " if leaf.limits.unit else ""
                line = f"    {leaf.name}: {to_json(values[leaf.name])}"
                text += f"{line:48} # {unit}{leaf.limits.doc}\n"
    return text


def _of_orbits(paths: list[Path], date: str | None, duration: str) -> str:
    from formation_gnc.interchange.starts import departure, read_orbits, start_of
    from formation_gnc.interchange.times import utc

    seconds = to_si(duration, "s")
    try:
        length = float(duration) if seconds is None else seconds
        if not 0.0 < length < float("inf"):
            raise ValueError
    except ValueError:
        raise ParameterError(f"duration {duration!r}: is not allowed; it must be above 0, as 1 d or 3600") from None
    epoch = None if date is None else to_si(date, EPOCH_UNIT)
    if date is not None and epoch is None:
        raise ParameterError(f"epoch {date!r}: is not allowed; it must be like 2026-11-28T12:00:00Z")
    orbits = read_orbits(paths)
    start = start_of(orbits, epoch)
    alone, between = departure(orbits, start.epoch, length)
    chief = start.chief
    chief_name, *others = start.names
    deputies = {f"deputy{number}": state for number, state in enumerate(start.relative, 1)}
    named = "".join(f"; {deputy} is {name}" for deputy, name in zip(deputies, others, strict=True))
    text = f"""# From {", ".join(path.name for path in paths)}: the chief is {chief_name}{named}.
# Coasting under J2 alone parts from the source by {alone:.3g} m at most over the run{
        f", relative to the chief by {between:.3g} m" if others else ""
    }.
# Sensors, thrusters and laws are those of {BASE} until you give your own.
extends: {BASE}

/**:
  ros__parameters:
    epoch: {utc(start.epoch):%Y-%m-%dT%H:%M:%S.%fZ}
    chief:                           # osculating, mean equator and equinox of J2000
      semi_major_axis: {chief.semi_major_axis * 1e-3!r} km
      eccentricity: {chief.eccentricity!r}
      inclination: {degrees(chief.inclination)!r} deg
      right_ascension: {degrees(chief.right_ascension)!r} deg
      argument_of_perigee: {degrees(chief.argument_of_perigee)!r} deg
      true_anomaly: {degrees(chief.true_anomaly)!r} deg

/plant:
  ros__parameters:
    duration: {duration if seconds is not None else length}
"""
    if not deputies:
        return text
    text += f"    deputies: [{', '.join(deputies)}]\n"
    for name, state in deputies.items():
        text += f"    {name}:\n      relative_state: {state.tolist()}  # m, m/s, Hill frame\n"
    states = [value for state in deputies.values() for value in state.tolist()]
    text += f"""
/**/guidance:
  ros__parameters:
    formation: slot_list             # each deputy is to stay on its relative orbit
    slot_list:
      states: {states}
"""
    for slot, name in enumerate(deputies):
        text += f"/{name}/guidance:\n  ros__parameters: {{slot: {slot}}}\n" if slot else ""
    return text
