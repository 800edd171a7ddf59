"""The ROS shell: records to and from bytes, topics, processes."""
