"""Plain CDR, little-endian: how DDS lays out the fields of a message, every number aligned to its size.

The fields of one message become plain values, one after the other, which one `struct` packs and unpacks.
Where all values lie hangs on the counts alone: of elements in sequences, and of bytes in texts.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol, override

import numpy as np

from formation_gnc.interface import NANOSECONDS

ENCAPSULATION = b"\0\1\0\0"
"""What a message begins with; numbers are aligned from its end on."""

COUNT = struct.Struct("<I")


class Pen:
    """Draws the layout of a message, field by field, told the counts in it on the way."""

    def __init__(self, tell: Callable[[int], int]) -> None:
        """Ask `tell` for the count that stands at a place (bytes)."""
        self._tell, self._place, self._counted = tell, len(ENCAPSULATION), 0
        self._whole, self._probe, self._counts = f"<{self._place}s", "<", list[int]()

    def put(self, code: str, number: int | None = None) -> None:
        """Draw one number, or the bytes of any number of a kind."""
        size = struct.calcsize(f"<{code}")
        gap = (len(ENCAPSULATION) - self._place) % size if number != 0 else 0
        self._whole += f"{gap}x{code}" if number is None else f"{gap}x{number * size}s"
        self._place += gap + size * (1 if number is None else number)

    def count(self) -> int:
        """Draw a count of what follows, and say what it is."""
        self.put("I")
        place = self._place - COUNT.size
        self._probe += f"{place - self._counted}xI"
        self._counted = self._place
        self._counts.append(self._tell(place))
        return self._counts[-1]

    def layout(self) -> "Layout":
        """What has been drawn."""
        return Layout(struct.Struct(self._whole), struct.Struct(self._probe), tuple(self._counts))


@dataclass(frozen=True, slots=True)
class Layout:
    """Where all values lie in the messages of one type that have the same counts."""

    whole: struct.Struct
    probe: struct.Struct  # reads the counts alone
    counts: tuple[int, ...]


class Kind(Protocol):
    """How a field becomes plain values, one after the other, and back."""

    def draw(self, pen: Pen) -> None:
        """Lay the field out."""

    def write(self, value: Any, values: list[Any], counts: list[int]) -> None:
        """Append its values, and to `counts` as well those that say how many follow."""

    def read(self, values: Iterator[Any]) -> Any:
        """The field from its values."""


@dataclass(frozen=True, slots=True)
class Number(Kind):
    """One number of a kind that `struct` knows by `code`."""

    code: str

    @override
    def draw(self, pen: Pen) -> None:
        pen.put(self.code)

    @override
    def write(self, value: Any, values: list[Any], counts: list[int]) -> None:
        values.append(value)

    @override
    def read(self, values: Iterator[Any]) -> Any:
        return next(values)


@dataclass(frozen=True, slots=True)
class Numbers(Kind):
    """`number` numbers of a kind, any if that is None; a list, or an array if there is a `shape`."""

    dtype: np.dtype[Any]
    number: int | None
    shape: tuple[int, ...] | None

    @override
    def draw(self, pen: Pen) -> None:
        pen.put(self.dtype.char, pen.count() if self.number is None else self.number)

    @override
    def write(self, value: Any, values: list[Any], counts: list[int]) -> None:
        array = np.asarray(value, self.dtype)
        if self.number is None:
            values.append(array.size)
            counts.append(array.size)
        elif array.size != self.number:
            raise ValueError(f"{array.size} numbers where the message has {self.number}")
        values.append(array.tobytes())

    @override
    def read(self, values: Iterator[Any]) -> Any:
        if self.number is None:
            next(values)
        array = np.frombuffer(bytearray(next(values)), self.dtype)  # to be written to, as any array
        if self.shape is None:
            return array.tolist()
        return array if len(self.shape) == 1 else array.reshape(self.shape)


class Text(Kind):
    """Text in UTF-8, ended by a zero."""

    @override
    def draw(self, pen: Pen) -> None:
        pen.put("B", pen.count())

    @override
    def write(self, value: str, values: list[Any], counts: list[int]) -> None:
        data = value.encode() + b"\0"
        values += len(data), data
        counts.append(len(data))

    @override
    def read(self, values: Iterator[Any]) -> str:
        next(values)
        text: bytes = next(values)
        return text[:-1].decode(errors="replace")


@dataclass(frozen=True, slots=True)
class Header(Kind):
    """Of a record's time, with the frame that its message is in."""

    frame_id: str
    text: Text

    @override
    def draw(self, pen: Pen) -> None:
        pen.put("i")
        pen.put("I")
        self.text.draw(pen)

    @override
    def write(self, value: int, values: list[Any], counts: list[int]) -> None:
        values += divmod(value, NANOSECONDS)
        self.text.write(self.frame_id, values, counts)

    @override
    def read(self, values: Iterator[Any]) -> int:
        time: int = next(values) * NANOSECONDS + next(values)
        self.text.read(values)
        return time


@dataclass(frozen=True, slots=True)
class Records(Kind):
    """Any number of records of one type."""

    item: Kind

    @override
    def draw(self, pen: Pen) -> None:
        for _ in range(pen.count()):
            self.item.draw(pen)

    @override
    def write(self, value: list[Any], values: list[Any], counts: list[int]) -> None:
        values.append(len(value))
        counts.append(len(value))
        for each in value:
            self.item.write(each, values, counts)

    @override
    def read(self, values: Iterator[Any]) -> list[Any]:
        return [self.item.read(values) for _ in range(next(values))]
