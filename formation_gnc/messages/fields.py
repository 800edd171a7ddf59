"""Kinds of message fields: where their values lie in CDR, and the source code that packs and unpacks them."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import prod
from struct import Struct, error
from typing import Any, NoReturn

import numpy as np

from formation_gnc.messages.layout import Layout
from formation_gnc.types import NANOSECONDS, Times, Vector

TIME = Struct("<iI")
"""builtin_interfaces Time and Duration: whole seconds, rounded down, and the nanoseconds from there."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message, and of the record that mirrors it.

    Packing and unpacking are source code. Lists of expressions and targets have a comma behind each item.
    Local variables are an underscore and the field's name, with or without a suffix behind two more.
    """

    name: str
    append_to: Callable[[Layout], None]
    prepare: str
    """Statements that come first when a `record` is packed."""
    counts: str
    """Counts of a prepared record."""
    values: str
    """All values of a prepared record, counts included."""
    targets: str
    """What the values are unpacked into."""
    count_targets: str
    """Those of the targets that are counts."""
    result: str
    """Value of the record's field, from the targets."""
    elements: "Elements | None" = None


@dataclass(frozen=True, slots=True)
class Elements:
    """Elements of a list of records."""

    record_type: type | None
    fields: tuple[Field, ...]


def number(name: str, code: str) -> Field:
    """One number of a struct type."""
    return Field(name, lambda layout: layout.add(code), "", "", f"record.{name},", f"_{name},", "", f"_{name}")


def time(name: str) -> Field:
    """A Time or Duration, int nanoseconds in the record."""
    targets = f"_{name}, _{name}__rest,"
    result = f"_{name} * {NANOSECONDS} + _{name}__rest"
    return Field(name, _add_time, "", "", f"*divmod(record.{name}, {NANOSECONDS}),", targets, "", result)


def header(name: str, frame_id: str) -> Field:
    """A std_msgs Header; the record has its stamp as int nanoseconds."""
    stamp, frame = time(name), frame_id.encode() + b"\0"

    def append_to(layout: Layout) -> None:
        stamp.append_to(layout)
        count = layout.count()
        if layout.unpacks:
            layout.skip(count)
        else:
            layout.add("B", count, as_bytes=True)

    values = f"{stamp.values} {len(frame)}, {frame!r},"
    count = f"_{name}__count,"
    return Field(name, append_to, "", f"{len(frame)},", values, f"{stamp.targets} {count}", count, stamp.result)


def numbers(name: str, code: str, size: int) -> Field:
    """A list of `size` numbers."""
    prepare = f"_{name} = record.{name}; {_check(name, f'len(_{name})', size)}"
    targets = "".join(f"_{name}__{index}," for index in range(size))
    return Field(name, lambda layout: layout.add(code, size), prepare, "", f"*_{name},", targets, "", f"[{targets}]")


def sequence(name: str, code: str) -> Field:
    """A list of any number of numbers."""

    def append_to(layout: Layout) -> None:
        layout.add(code, layout.count(), as_bytes=layout.unpacks)

    result = f"[each for (each,) in each_{np.dtype(code).name}(_{name})] if _{name} else []"  # most are empty
    return _counted(name, append_to, f"_{name} = record.{name}", f"len(_{name})", f"*_{name}", result)


def text(name: str) -> Field:
    """UTF-8, ended by a zero."""

    def append_to(layout: Layout) -> None:
        count = layout.count()
        layout.add("B", max(count - 1, 0), as_bytes=True)
        layout.skip(min(count, 1))

    prepare, result = f"_{name} = record.{name}.encode()", f"_{name}.decode('utf-8', 'replace')"
    return _counted(name, append_to, prepare, f"len(_{name}) + 1", f"_{name}", result)


def array(name: str, code: str, shape: tuple[int, ...]) -> Field:
    """An array of fixed shape, written row by row."""
    dtype, size = np.dtype(code), prod(shape)
    prepare = f"_{name} = asarray(record.{name}, {dtype.name}).tobytes()"
    prepare += f"; {_check(name, f'len(_{name}) // {dtype.itemsize}', size)}"
    result = f"ndarray({shape}, {dtype.name}, bytearray(_{name}))"  # writable, as any array
    return Field(
        name,
        lambda layout: layout.add(code, size, as_bytes=True),
        prepare=prepare,
        counts="",
        values=f"_{name},",
        targets=f"_{name},",
        count_targets="",
        result=result,
    )


def rows(name: str, code: str, shape: tuple[int, ...]) -> Field:
    """An array of any number of rows of a shape: of numbers, or of messages that hold nothing but numbers."""
    dtype, size = np.dtype(code), prod(shape)
    prepare = f"_{name} = asarray(record.{name}, {dtype.name}).tobytes()"
    if size > 1:
        prepare += f"; len(_{name}) % {dtype.itemsize * size} and reject_rows({name!r}, record.{name}, {shape})"

    def append_to(layout: Layout) -> None:
        layout.add(code, layout.count() * size, as_bytes=True)

    sides = "".join(f" {side}," for side in shape)
    result = f"ndarray((_{name}__count,{sides}), {dtype.name}, bytearray(_{name}))"
    return _counted(name, append_to, prepare, f"len(_{name}) // {dtype.itemsize * size}", f"_{name}", result)


def times(name: str, width: int) -> Field:
    """An array (N, width) of int nanoseconds, from messages that hold nothing but a Time or Duration each."""

    def append_to(layout: Layout) -> None:
        layout.add("I", 2 * width * layout.count(), as_bytes=True)

    prepare = f"_{name} = pack_times({name!r}, record.{name}, {width}) if len(record.{name}) else b''"
    result = f"unpack_times(_{name}, {width}) if _{name} else ndarray((0, {width}), int64)"  # most are empty
    return _counted(name, append_to, prepare, f"len(_{name}) // {TIME.size * width}", f"_{name}", result)


def records(name: str, record_type: type | None, fields: list[Field]) -> Field:
    """A list of records that have no lists of records themselves; no record type where it is not read."""

    def append_to(layout: Layout) -> None:
        layout.elements(name, layout.count(), fields)

    targets = "".join(field.targets for field in fields)
    result = f"new_{name}({arguments(record_type, fields)})" if record_type else "None"
    values = f"batched(unpack_{name}(data), {targets.count(',')})"
    flat = f"_{name}__counts, _{name}__values"
    return Field(
        name,
        append_to,
        prepare=f"_{name} = record.{name}; {flat} = flatten(pack_{name}, _{name}) if _{name} else ((), ())",
        counts=f"len(_{name}), *_{name}__counts,",
        values=f"len(_{name}), *_{name}__values,",
        targets=f"_{name}__count,",
        count_targets=f"_{name}__count,",
        result=f"[{result} for {targets} in {values}] if _{name}__count else []",
        elements=Elements(record_type, tuple(fields)),
    )


def arguments(record_type: type, fields: Sequence[Field]) -> str:
    """Source of the arguments that construct a record from the targets of its message's fields.

    By place, since calls by keyword take twice as long.
    """
    results = {field.name: field.result for field in fields}
    return ", ".join(results[field.name] for field in dataclasses.fields(record_type))


def flatten[T](
    pack: Callable[[T], tuple[tuple[int, ...], tuple[Any, ...]]], elements: Sequence[T]
) -> tuple[list[int], list[Any]]:
    """Counts and values of all elements of a list."""
    counts, values = list[int](), list[Any]()
    for each in elements:
        own_counts, own_values = pack(each)
        counts += own_counts
        values += own_values
    return counts, values


def pack_times(name: str, given: Times, width: int) -> bytes:
    """Times (ns) as the bytes of Time messages; raises ValueError for others."""
    nanoseconds = np.asarray(given)
    if nanoseconds.dtype.kind != "i" or nanoseconds.shape[1:] != (width,):
        raise ValueError(f"{name}: {nanoseconds.dtype} of shape {nanoseconds.shape}, must be int64 (N, {width})")
    times = nanoseconds.ravel().tolist()  # a few: faster than arrays
    try:
        return b"".join(TIME.pack(*divmod(each, NANOSECONDS)) for each in times)
    except error:
        raise ValueError(f"{name}: {[each // NANOSECONDS for each in times]} s, must be within 32 bits") from None


def unpack_times(packed: bytes, width: int) -> Times:
    """Times (N, width), ns, from the bytes of Time messages."""
    times = [seconds * NANOSECONDS + rest for seconds, rest in TIME.iter_unpack(packed)]
    return np.array(times, dtype=np.int64).reshape(-1, width)


def reject_size(name: str, size: int, allowed: int) -> NoReturn:
    """Raise ValueError for an array or list of another size than the message's."""
    raise ValueError(f"{name}: {size} numbers where the message has {allowed}")


def reject_rows(name: str, given: Vector, shape: tuple[int, ...]) -> NoReturn:
    """Raise ValueError for an array whose rows are not those of the message."""
    raise ValueError(f"{name}: {np.size(given)} numbers in rows of {prod(shape)}")


def _add_time(layout: Layout) -> None:
    layout.add("i")
    layout.add("I")


def _counted(
    name: str, append_to: Callable[[Layout], None], prepare: str, count: str, value: str, result: str
) -> Field:
    target = f"_{name}__count,"
    return Field(name, append_to, prepare, f"{count},", f"{count}, {value},", f"{target} _{name},", target, result)


def _check(name: str, size: str, allowed: int) -> str:
    return f"{size} == {allowed} or reject_size({name!r}, {size}, {allowed})"
