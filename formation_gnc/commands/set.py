"""Change parameters of a node in flight.

The node takes all of them or none, at the tick after the call. `formation-gnc sil` prints the ROS domain of its
run: ROS_DOMAIN_ID=N formation-gnc set deputy1/controller algorithm=mpc
"""

import argparse

from formation_gnc.commands.ros import need_ros
from formation_gnc.errors import ConfigurationError
from formation_gnc.sil.overrides import parse_value


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("node", help="name of the node, as deputy1/controller")
    parser.add_argument("values", metavar="PARAMETER=VALUE", nargs="+", help="value as in a parameter file")


def run(options: argparse.Namespace) -> int:
    """Set the parameters."""
    values = {}
    for entry in options.values:
        name, equals, text = entry.partition("=")
        if not (name and equals):
            raise ConfigurationError(f"set {entry!r}: is not allowed; it must be like algorithm=mpc")
        values[name] = parse_value(name, text)
    need_ros()
    from formation_gnc.transport.parameter_client import set_parameters

    node = f"/{options.node.strip('/')}"
    set_parameters(node, values)
    for name, value in values.items():
        print(f"{node}: {name} = {value}")
    return 0
