"""Writing, reading and recovering MCAP bags."""

from formation_gnc.recording.reader import Bag, identical, read

__all__ = ["Bag", "identical", "read"]
