"""Where the values of a message lie in plain little-endian CDR, as formats of `struct`."""

import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any, Protocol, override

LITTLE_ENDIAN = b"\0\1"
"""Encapsulation of plain little-endian CDR, the first bytes of a message."""

BODY = 4
"""Offset of the first field (bytes); fields are aligned from here."""

COUNT = struct.Struct("<I")


class LayoutItem(Protocol):
    """What can be appended to a layout: a field."""

    @property
    def append_to(self) -> "Callable[[Layout], None]":
        """Appends the values."""


class Format:
    """A struct format for values at given offsets; everything else is padding."""

    def __init__(self) -> None:
        """Without a value."""
        self._format, self._end = "<", 0

    def add(self, offset: int, size: int, values: str) -> None:
        """Append values of `size` bytes, as `struct` writes them."""
        self._format += f"{offset - self._end}x{values}"
        self._end = offset + size

    def packer(self, size: int) -> Callable[..., bytes]:
        """Packs values into a message of `size` bytes."""
        return struct.Struct(f"{self._format}{size - self._end}x").pack

    def unpacker(self) -> Callable[[bytes], tuple[Any, ...]]:
        """Unpacks the values of a message."""
        return struct.Struct(self._format).unpack_from


class Layout(ABC):
    """Offsets of a message's values, which depend on the counts in it alone; fields append themselves."""

    unpacks: bool

    def __init__(self) -> None:
        """Begin with the encapsulation."""
        self.offset = BODY
        self.format = Format()
        self.format.add(0, len(LITTLE_ENDIAN), f"{len(LITTLE_ENDIAN)}s")

    def add(self, code: str, number: int = 1, *, as_bytes: bool = False) -> None:
        """Append numbers of the type that `struct` calls `code`, aligned to their size."""
        size = struct.calcsize(f"<{code}")
        if number:
            self.offset += (BODY - self.offset) % size
        start, self.offset = self.offset, self.offset + number * size
        self.place(start, number * size, f"{number * size}s" if as_bytes else f"{number}{code}")

    def skip(self, size: int) -> None:
        """Append bytes that carry nothing."""
        self.offset += size

    def place(self, offset: int, size: int, values: str) -> None:
        """Add values to the format in use."""
        self.format.add(offset, size, values)

    @abstractmethod
    def count(self) -> int:
        """Append a count and return it."""

    @abstractmethod
    def elements(self, name: str, number: int, fields: Iterable[LayoutItem]) -> None:
        """Append the elements of a list field."""


class PackingLayout(Layout):
    """Layout of a message to be written, with all values in one format."""

    unpacks = False

    def __init__(self, counts: Iterable[int]) -> None:
        """Take the counts in their order."""
        super().__init__()
        self._counts = iter(counts)

    @override
    def count(self) -> int:
        self.add("I")
        return next(self._counts)

    @override
    def elements(self, name: str, number: int, fields: Iterable[LayoutItem]) -> None:
        for _ in range(number):
            for field in fields:
                field.append_to(self)


class UnpackingLayout(Layout):
    """Layout of a message that was received.

    `format` has the values of the message's own fields, of those that are not wanted the counts only;
    `counts` are their values. The format of each list in `lists` has its elements' values, `inner_format`
    the counts in all elements, of values `inner_counts`.
    """

    unpacks = True

    def __init__(self, data: bytes) -> None:
        """Read the counts from `data`."""
        super().__init__()
        self._data = data
        self.inner_format = Format()
        self.lists: dict[str, Format] = {}
        self.counts: list[int] = []
        self.inner_counts: list[int] = []
        self.is_wanted = True
        """Whether the record has the field that is being appended."""
        self._list: Format | None = None

    def check_size(self) -> None:
        """Raise ValueError when the message is too short for what has been appended."""
        if self.offset > len(self._data):
            raise ValueError(f"its fields take {self.offset} bytes or more")

    @override
    def place(self, offset: int, size: int, values: str) -> None:
        self.check_size()
        if self.is_wanted:
            (self._list or self.format).add(offset, size, values)

    @override
    def count(self) -> int:
        offset = self.offset + (BODY - self.offset) % COUNT.size
        (count,) = COUNT.unpack_from(self._data, offset)
        if count > len(self._data):
            raise ValueError(f"{count} elements in {len(self._data)} bytes")
        self.offset = offset + COUNT.size
        for counts in [self.inner_format, self._list] if self._list else [self.format]:
            counts.add(offset, COUNT.size, "I")
        (self.inner_counts if self._list else self.counts).append(count)
        return int(count)

    @override
    def elements(self, name: str, number: int, fields: Iterable[LayoutItem]) -> None:
        self._list = self.lists[name] = Format()
        for _ in range(number):
            for field in fields:
                field.append_to(self)
        self._list = None
