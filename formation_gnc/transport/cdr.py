"""Plain CDR, little-endian: how DDS lays out the fields of a message, every number aligned to its size.

The fields of one message become plain values, one after the other, which one `struct` packs and unpacks.
Where all values lie hangs on the counts alone: of elements in sequences, and of bytes in texts.

What turns a record into its message and back is Python that is written once for every type of record: `Codec`
fills in a form with what each `Field` says. A node that wakes for a moment every tick does so with cold
caches, and every frame and object that a loop over fields would touch costs it dear (decision 0008).
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from itertools import batched
from math import prod
from typing import Any, NoReturn

import numpy as np

from formation_gnc.types import NANOSECONDS

LITTLE_ENDIAN = b"\0\1"
"""What a message begins with."""

BEGIN = 4
"""Where its fields begin (bytes); they are aligned from here on."""

COUNT = struct.Struct("<I")


class Pen:
    """Draws the layout of a message, field by field, told the counts in it on the way."""

    def __init__(self, tell: Callable[[int], int], *, reads: bool) -> None:
        """Ask `tell` for the count that stands at a place (bytes); is it for a message that is read?"""
        self._tell, self._place, self.reads, self.hides = tell, BEGIN, reads, False
        self.layout, self.counts = f"<{len(LITTLE_ENDIAN)}s{BEGIN - len(LITTLE_ENDIAN)}x", list[int]()

    def put(self, code: str, number: int = 1, form: str = "") -> None:
        """Draw numbers of a kind that `struct` knows by `code`: one by one, or their bytes in a `form`.

        While it `hides`, only room is left for them.
        """
        self._draw(code, number, "x" if self.hides else form)

    def count(self) -> int:
        """Draw a count of what follows, and say what it is."""
        self._draw("I", 1, "")
        self.counts.append(self._tell(self._place - COUNT.size))
        return self.counts[-1]

    def _draw(self, code: str, number: int, form: str) -> None:
        size = struct.calcsize(f"<{code}")
        gap = (BEGIN - self._place) % size if number else 0
        self.layout += f"{gap}x{number * size}{form}" if form else f"{gap}x{number}{code}"
        self._place += gap + number * size


@dataclass(frozen=True, slots=True)
class Field:
    """How a field of a record becomes plain values, one after the other, and back, in Python.

    In a list every expression ends with a comma. Variables are the field's name behind an underscore, with or
    without an ending behind two more, which no name has: so they differ from each other and from all else.
    """

    name: str
    draw: Callable[[Pen], None]
    first: str  # statements, before anything can be taken from a `record`
    taken: str  # list of the counts in it
    values: str  # list of all its values
    variables: str  # list of what they are read into
    given: str  # list of the counts among those
    made: str  # the field from them
    item: "Codec | None" = None  # what all this may call `item_` and the field's name


def number(name: str, code: str) -> Field:
    """One number of a kind."""
    return Field(name, lambda pen: pen.put(code), "", "", f"record.{name},", f"_{name},", "", f"_{name}")


def numbers(name: str, code: str, number: int) -> Field:
    """A list of so many numbers of a kind."""
    first = f"_{name} = record.{name}; {_check(f'len(_{name})', number)}"
    variables = "".join(f"_{name}__{index}," for index in range(number))
    made = f"[{variables}]"
    return Field(name, lambda pen: pen.put(code, number), first, "", f"*_{name},", variables, "", made)


def sequence(name: str, code: str) -> Field:
    """A list of any number of numbers of a kind."""

    def draw(pen: Pen) -> None:
        pen.put(code, pen.count(), "s" if pen.reads else "")

    made = f"[each for (each,) in each_{np.dtype(code).name}(_{name})] if _{name} else []"  # most are empty
    return _counted(name, draw, f"_{name} = record.{name}", f"len(_{name})", f"*_{name}", made)


def array(name: str, code: str, shape: tuple[int, ...]) -> Field:
    """An array of numbers of a kind, of a shape whose first side may be -1: any."""
    dtype, size = np.dtype(code), abs(prod(shape))
    first = f"_{name} = asarray(record.{name}, {dtype.name}).tobytes()"
    count = f"len(_{name}) // {dtype.itemsize}"
    sides = "".join(f"{side}," if side >= 0 else f"_{name}__count // {size}," for side in shape)
    made = f"ndarray(({sides}), {dtype.name}, bytearray(_{name}))"  # to be written to, as any array

    def draw(pen: Pen) -> None:
        count = pen.count()
        if count % size:
            raise ValueError(f"{count} numbers in rows of {size}")
        pen.put(code, count, "s")

    if shape[0] < 0:
        return _counted(name, draw, first, count, f"_{name}", made)
    first += f"; {_check(count, size)}"
    return Field(name, lambda pen: pen.put(code, size, "s"), first, "", f"_{name},", f"_{name},", "", made)


def text(name: str) -> Field:
    """Text in UTF-8, ended by a zero."""

    def draw(pen: Pen) -> None:
        count = pen.count()
        pen.put("B", max(count - 1, 0), "s")
        pen.put("B", min(count, 1), "x")

    first, made = f"_{name} = record.{name}.encode()", f"_{name}.decode('utf-8', 'replace')"
    return _counted(name, draw, first, f"len(_{name}) + 1", f"_{name}", made)


def header(name: str, frame_id: str) -> Field:
    """Of a record's time, with the frame that its message is in."""
    frame = frame_id.encode() + b"\0"

    def draw(pen: Pen) -> None:
        pen.put("i")
        pen.put("I")
        pen.put("B", pen.count(), "x" if pen.reads else "s")

    return Field(
        name,
        draw,
        first="",
        taken=f"{len(frame)},",
        values=f"*divmod(record.{name}, {NANOSECONDS}), {len(frame)}, {frame!r},",
        variables=f"_{name}, _{name}__rest, _{name}__count,",
        given=f"_{name}__count,",
        made=f"_{name} * {NANOSECONDS} + _{name}__rest",
    )


def records(name: str, item: "Codec") -> Field:
    """Any number of records of one type: one such field to a message, and none in its records."""

    def draw(pen: Pen) -> None:
        for _ in range(pen.count()):
            item.draw(pen)

    each = f"for {item.variables} in batched(_{name}, {item.variables.count(',')})"
    return Field(
        name,
        draw,
        first=f"_{name} = [item_{name}.take(each) for each in record.{name}]",
        taken=f"len(_{name}), *[count for counts, _ in _{name} for count in counts],",
        values=f"len(_{name}), *[value for _, values in _{name} for value in values],",
        variables=f"_{name}__count, *_{name},",
        given=f"_{name}__count, *[count {each} for count in ({item.given})],",
        made=f"[item_{name}.record_type({item.made}) {each}]",
        item=item,
    )


def _counted(name: str, draw: Callable[[Pen], None], first: str, count: str, value: str, made: str) -> Field:
    given = f"_{name}__count,"
    return Field(name, draw, first, f"{count},", f"{count}, {value},", f"{given} _{name},", given, made)


def _check(number: str, allowed: int) -> str:
    return f"{number} == {allowed} or reject({number}, {allowed})"


def _reject(number: int, allowed: int) -> NoReturn:
    raise ValueError(f"{number} numbers where the message has {allowed}")


_FORM = """
def encode(record):
    {first}
    return packer(({taken}))({LITTLE_ENDIAN}, {values})

def decode(data):
    layout = met.get(len(data))
    if layout:
        unpack, counts = layout
        _, {variables} = unpack(data)
        if (_, {given}) == counts:
            return record_type({made})
    return decode(meet(data))

def take(record):
    {first}
    return ({taken}), ({values})
"""

_NAMES = {"asarray": np.asarray, "ndarray": np.ndarray, "batched": batched, "reject": _reject}
_NAMES |= {np.dtype(code).name: np.dtype(code) for code in "?BIQd"}
_NAMES |= {f"each_{np.dtype(code).name}": struct.Struct(f"<{code}").iter_unpack for code in "?BIQd"}


class Codec:
    """How the records of one type become messages, and back."""

    encode: Callable[[Any], bytes]
    """The message with the contents of a record that lacks nothing of it."""
    decode: Callable[[bytes], Any]
    """The record with a message's contents; raises what `meet` does."""
    take: Callable[[Any], tuple[tuple[int, ...], tuple[Any, ...]]]
    """The counts and all values of a record that is part of another."""

    def __init__(self, record_type: type[Any], of_message: list[Field]) -> None:
        """Write the functions, from all fields of the message."""
        self.record_type, self._fields = record_type, of_message
        self._wanted = [each.name for each in fields(record_type)]
        self._met: dict[int, tuple[Callable[[bytes], Any], tuple[Any, ...]]] = {}  # by number of bytes
        made = {each.name: each.made for each in of_message}
        variables = (each.variables if each.name in self._wanted else each.given for each in of_message)
        self.variables = "".join(variables)
        self.given = "".join(each.given for each in of_message)
        self.made = ", ".join(made[name] for name in self._wanted)
        source = _FORM.format(
            first="\n    ".join(each.first for each in of_message),
            taken="".join(each.taken for each in of_message),
            values="".join(each.values for each in of_message),
            variables=self.variables,
            given=self.given,
            made=self.made,
            LITTLE_ENDIAN=LITTLE_ENDIAN,
        )
        names: dict[str, Any] = _NAMES | {"record_type": record_type, "packer": cache(self._packer)}
        names |= {"met": self._met, "meet": self.meet}
        names |= {f"item_{each.name}": each.item for each in of_message}
        exec(compile(source, f"<{record_type.__name__} as CDR>", "exec"), names)
        self.encode, self.decode, self.take = names["encode"], names["decode"], names["take"]

    def draw(self, pen: Pen) -> None:
        """Lay all fields out; those that the record lacks are not read, but their counts."""
        for each in self._fields:
            pen.hides = pen.reads and each.name not in self._wanted
            each.draw(pen)

    def meet(self, data: bytes) -> bytes:
        """Learn to read messages of this length with these counts; raises ValueError or struct.error.

        Returns the message, as it is to be read.
        """

        def tell(place: int) -> int:
            (count,) = COUNT.unpack_from(data, place)
            if count > len(data):
                raise ValueError(f"{count} of something")
            return int(count)

        pen = Pen(tell, reads=True)
        self.draw(pen)
        unpack = struct.Struct(pen.layout).unpack_from
        unpack(data)  # it fits
        self._met[len(data)] = unpack, (data[: len(LITTLE_ENDIAN)], *pen.counts)
        return data

    def _packer(self, counts: tuple[int, ...]) -> Callable[..., bytes]:
        told = iter(counts)
        pen = Pen(lambda place: next(told), reads=False)
        self.draw(pen)
        return struct.Struct(pen.layout).pack
