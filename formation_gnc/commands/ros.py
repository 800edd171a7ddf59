"""What of ROS the node graph takes, for commands that also work without."""

from importlib.util import find_spec

from formation_gnc.errors import ConfigurationError

PACKAGES = (
    *("rclpy", "domain_coordinator", "formation_gnc_msgs", "builtin_interfaces", "diagnostic_msgs", "geometry_msgs"),
    *("rcl_interfaces", "rosgraph_msgs", "std_msgs", "std_srvs", "visualization_msgs"),
)
"""ROS packages that nodes and their launcher import."""


def need_ros(otherwise: str = "") -> None:
    """Raise ConfigurationError that names the missing packages, where one is.

    Args:
        otherwise: what does without, for the error.
    """
    missing = [package for package in PACKAGES if find_spec(package) is None]
    if missing:
        raise ConfigurationError(
            f"the node graph needs ROS 2 Jazzy, which lacks {', '.join(missing)} here: source your workspace, or run "
            f"`make setup` in a clone of formation_gnc and source its env.sh{otherwise and f'; {otherwise}'}"
        )
