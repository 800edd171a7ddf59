"""Writing, reading and recovering MCAP bags."""
