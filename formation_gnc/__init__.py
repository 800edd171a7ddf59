"""Formation-flying guidance, navigation and control, as a ROS 2 node graph over a pure Python core."""

__version__ = "0.1.0"
