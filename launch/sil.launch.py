"""Fly a scenario, all its deputies, and record it.

`ros2 launch formation_gnc sil.launch.py scenario:=tetrahedral composed:=true`
"""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from formation_gnc.flight.graph import MODULES
from launch import LaunchContext, LaunchDescription


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario",
                default_value="leader_follower",
                description="name of a scenario, or path of a parameter file",
            ),
            DeclareLaunchArgument(
                "composed",
                default_value="false",
                choices=["true", "false"],
                description="one process for each satellite, not one for each of its nodes",
            ),
            OpaqueFunction(function=nodes),
        ]
    )


def nodes(context: LaunchContext) -> list[Node]:
    scenario, composed = (LaunchConfiguration(name).perform(context) for name in ("scenario", "composed"))
    path = Path(scenario)
    if not path.suffix:
        path = Path(get_package_share_directory("formation_gnc"), "params", f"{scenario}.yaml")
    plant = yaml.safe_load(path.read_text())["/plant"]["ros__parameters"]

    def node(executable: str, namespace: str = "", **options: object) -> Node:
        return Node(
            package="formation_gnc",
            executable=executable,
            namespace=namespace,
            parameters=[str(path)],
            output="screen",
            **options,
        )

    return [
        node("plant", on_exit=Shutdown(reason="the flight is over")),
        node("recorder"),
        *(
            node(executable, namespace)
            for namespace in plant.get("deputies", ["deputy1"])
            for executable in (["satellite"] if composed == "true" else MODULES)
        ),
    ]
