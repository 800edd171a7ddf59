"""Make a keystore: keys and permissions of DDS security for the processes of a scenario.

What each process may publish, hear, serve and call is read from the graph table. `formation-gnc sil --keystore DIR`
flies in it, as does `ros2 launch formation_gnc sil.launch.py keystore:=DIR`; an installed ROS 2 is needed for that,
not for making it. Whoever has the directory may join the flight: its files are for their owner alone.
"""

import argparse
from pathlib import Path

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.access import OPERATOR, access_by_process
from formation_gnc.sil.scenario import load_scenario


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("scenario", help="name of a scenario in params/, or a ROS 2 parameter file")
    parser.add_argument("directory", type=Path, help="directory to make")
    parser.add_argument(
        "--namespace", metavar="NAME", default="", help="namespace of the formation, as of the launch file"
    )


def run(options: argparse.Namespace) -> int:
    """Make it, and say what it holds."""
    deputies = load_scenario(options.scenario).plant.deputies
    namespace = options.namespace.strip("/")
    if not all(token.isidentifier() for token in namespace.split("/") if namespace):
        raise ConfigurationError(f"namespace {namespace!r}: is not allowed; it must be a name of ROS, as north/inner")
    from formation_gnc.transport.keystore import VALIDITY, make_keystore

    accesses = access_by_process(deputies, f"/{namespace}" if namespace else "")
    make_keystore(options.directory, accesses)
    print(f"{options.directory}: {len(accesses)} enclaves, valid for {VALIDITY.days} days; people join in {OPERATOR}")
    return 0
