"""Fly params/leader_follower.yaml with `ros2 launch formation_gnc leader_follower.launch.py`."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch.actions import Shutdown
from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    scenario = Path(get_package_share_directory("formation_gnc"), "params", "leader_follower.yaml")
    plant = yaml.safe_load(scenario.read_text())["/plant"]["ros__parameters"]

    def node(executable: str, namespace: str = "", **options: object) -> Node:
        return Node(
            package="formation_gnc",
            executable=executable,
            namespace=namespace,
            parameters=[str(scenario)],
            output="screen",
            **options,
        )

    return LaunchDescription(
        [
            node("plant", on_exit=Shutdown(reason="the flight is over")),
            node("recorder"),
            *(
                node(executable, namespace)
                for namespace in plant["deputies"]
                for executable in ("navigation", "guidance", "controller")
            ),
        ]
    )
