"""Scripts that build, check and document the project."""
