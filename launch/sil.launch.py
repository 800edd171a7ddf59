"""Fly a scenario, all its deputies, and record it.

`ros2 launch formation_gnc sil.launch.py scenario:=tetrahedral use_composition:=true bag:=bags/fleet`

It can be included, below a namespace too: each namespace is a formation of its own, with a `/clock` of its own, and
the end of its flight ends its nodes alone.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction
from launch.events.process import ShutdownProcess
from launch.logging import launch_config
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from formation_gnc.flight.graph import MODULES
from formation_gnc.parameters import read_yaml
from formation_gnc.sil.scenario import EXTENDS, load_scenario
from formation_gnc.transport.security import check_secured, variables
from launch import LaunchContext, LaunchDescription

ARGUMENTS = {
    "scenario": ("leader_follower", "name of a scenario, or path of a parameter file"),
    "params_file": ("", "parameter file whose values go over the scenario's"),
    "namespace": ("", "namespace of the formation"),
    "use_sim_time": ("false", "whether the nodes' ROS clocks follow /clock; what they wait for is on a steady clock"),
    "log_level": ("", "least level of what is logged: debug, info, warn, error or fatal"),
    "use_composition": ("false", "one process for each satellite, not one for each of its nodes"),
    "composed": ("", "former name of use_composition"),
    "use_respawn": ("false", "start a deputy's node again when it has died"),
    "bag": ("", "directory to make for the bag; empty for bags/ and the date and time"),
    "record": ("true", "whether to record"),
    "seed": ("", "seed of the run; empty for the scenario's"),
    "duration": ("", "simulated time to fly, s; empty for the scenario's"),
    "controller": ("", "control law of every deputy; empty for the scenario's"),
    "keystore": ("", "folder made by formation-gnc keystore: fly in its enclaves, or not at all"),
    "display": ("false", "markers and transforms for RViz and Foxglove"),
}
"""Default and meaning of each argument."""

SWITCHES = ("use_sim_time", "use_composition", "use_respawn", "record", "display")


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(
                    name,
                    default_value=default,
                    description=meaning,
                    **({"choices": ["true", "false"]} if name in SWITCHES else {}),
                )
                for name, (default, meaning) in ARGUMENTS.items()
            ),
            OpaqueFunction(function=nodes),
        ]
    )


def nodes(context: LaunchContext) -> list[Node]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    is_on = {name: given[name] == "true" for name in (*SWITCHES, "composed")}
    path = Path(given["scenario"])
    if not path.suffix:
        path = Path(get_package_share_directory("formation_gnc"), "params", f"{given['scenario']}.yaml")
    files = [str(readable_by_ros(path)), *([given["params_file"]] if given["params_file"] else [])]
    for_all = ["--log-level", given["log_level"]] if given["log_level"] else []
    for_all += ["-p", "use_sim_time:=true"] if is_on["use_sim_time"] else []
    keystore = Path(given["keystore"]) if given["keystore"] else None
    enclaves = list[str]()

    def node(executable: str, deputy: str = "", own: dict[str, str] | None = None, **options: object) -> Node:
        values = [f"{name}:={value}" for name, value in (own or {}).items() if value]
        namespace = "/".join(filter(None, (given["namespace"].strip("/"), deputy)))
        enclaves.append("/".join(("", *filter(None, (namespace, executable)))))
        return Node(
            package="formation_gnc",
            executable=executable,
            namespace=namespace,
            parameters=files,
            ros_arguments=["--enclave", enclaves[-1], *for_all, *(word for value in values for word in ("-p", value))],
            additional_env=variables(keystore) if keystore else {},
            output="screen",
            **options,
        )

    plant = {"wait_for_recorder": given["record"], "seed": given["seed"]}
    plant["duration"] = str(float(given["duration"])) if given["duration"] else ""
    # By the node's name, since a satellite is several nodes in one process.
    law = {"controller:algorithm": given["controller"]}
    again = {"respawn": is_on["use_respawn"], "respawn_delay": 1.0}
    # The flight's own nodes end with it, and nothing else of a launch description that includes this one.
    over = EmitEvent(event=ShutdownProcess(process_matcher=lambda process: process in started))
    started = [node("plant", own=plant, on_exit=over)]
    if is_on["record"]:
        started.append(node("recorder", own={"bag": given["bag"]}))
    if is_on["display"]:
        started.append(node("display"))
    for deputy in deputies(files):
        if is_on["use_composition"] or is_on["composed"]:
            started.append(node("satellite", deputy, law, **again))
        else:
            started += [node(name, deputy, law if name == "controller" else {}, **again) for name in MODULES]
    if keystore:
        check_secured(keystore, enclaves)  # raises before anything is started
    return started


def readable_by_ros(path: Path) -> Path:
    """A scenario's file; where it extends another scenario, which ROS does not know, a file with all that results."""
    if EXTENDS not in (read_yaml(path.read_text()) or {}):
        return path
    whole = Path(launch_config.log_dir, path.name)
    whole.write_text(load_scenario(str(path)).text())
    return whole


def deputies(files: list[str]) -> list[str]:
    """Names of the deputies that parameter files give the plant."""
    names = ["deputy1"]
    for file in files:
        sections = read_yaml(Path(file).read_text()) or {}
        for pattern in ("/**", "plant", "/plant", "/**/plant"):
            names = sections.get(pattern, {}).get("ros__parameters", {}).get("deputies", names)
    return names
