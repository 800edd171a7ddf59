"""Time for which a condition has held."""

from formation_gnc.types import NANOSECONDS


class HeldTime:
    """Time since a condition began to hold, from one look to the next."""

    __slots__ = ("_since",)

    def __init__(self) -> None:
        """Not held."""
        self._since: int | None = None

    def look(self, time: int, holds: bool) -> float:
        """Time (s) at a stamp (ns) since the first look in a row at which it held; 0 where it does not."""
        if not holds:
            self._since = None
            return 0.0
        if self._since is None:
            self._since = time
        return (time - self._since) / NANOSECONDS
