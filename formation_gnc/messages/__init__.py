"""Message definitions, and records to and from the bytes of their messages; without ROS."""
