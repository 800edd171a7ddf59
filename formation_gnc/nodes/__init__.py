"""The ROS shell: thin nodes over the core."""
