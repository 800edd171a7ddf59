"""Writing, reading and recovering MCAP bags."""

from formation_gnc.recording.difference import Difference, identical
from formation_gnc.recording.reader import Bag, read

__all__ = ["Bag", "Difference", "identical", "read"]
