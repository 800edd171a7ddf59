"""The forces on a satellite, one file a force, one registry."""
