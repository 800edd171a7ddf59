"""Time for which a condition has held."""

from formation_gnc.types import NANOSECONDS


class HeldTime:
    """Time since a value became what it is, from one look to the next."""

    __slots__ = ("_since", "_value")

    def __init__(self) -> None:
        """Not held."""
        self._value, self._since = 0, 0

    def look(self, time: int, value: int) -> float:
        """Time (s) at a stamp (ns) since the first look in a row at this value; 0 for the value 0, and for False."""
        if not value:
            self._value = 0
            return 0.0
        if value != self._value:
            self._value, self._since = value, time
        return (time - self._since) / NANOSECONDS
