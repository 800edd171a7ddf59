"""Attacks on a live graph, as data: what a stranger in the same ROS domain does."""
