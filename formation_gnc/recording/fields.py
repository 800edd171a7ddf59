"""Messages of a topic as arrays by field."""

from collections.abc import Iterator
from itertools import count, takewhile
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import BagError

Arrays = dict[str, NDArray[Any]]
"""Messages of a topic: an array per field, a row per message."""


class Fields(Arrays):
    """Messages of a topic as arrays by field; raises BagError for a field that they lack."""

    def __init__(self, source: str, arrays: Arrays) -> None:
        """Hold the arrays of a source, which errors name."""
        super().__init__(arrays)
        self._source = source

    def __missing__(self, field: str) -> NoReturn:
        """Raise BagError."""
        raise BagError(f"{self._source}: no message has a field {field}")

    def elements(self, field: str) -> Iterator[str]:
        """Names of the elements of a list of messages, "readings.0" and so on, of the longest list."""
        names = (f"{field}.{index}" for index in count())
        return takewhile(lambda name: any(each.startswith(f"{name}.") for each in self), names)

    def integers(self, field: str) -> NDArray[np.int64]:
        """Values of a field of integers.

        Raises:
            BagError: it has another type, as in a bag of another version of the messages.
        """
        column = self[field]
        if column.dtype.kind not in "iu":
            raise BagError(f"{self._source}: field {field} is not of integers")
        return column.astype(np.int64)
